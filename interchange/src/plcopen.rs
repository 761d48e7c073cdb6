//! PLCopen TC6 XML 2.01 and 2.0: ladders of OpenPLC Editor, Beremiz, CODESYS and others.
