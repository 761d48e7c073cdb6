//! What a person asks of a run, live or finished, folded from its journal.
