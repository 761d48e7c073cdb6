-- Controllers that can be bought. An absent row of `figures` is a figure that nobody has seen; there are no zeros for it.
CREATE TABLE sources (
    id INTEGER PRIMARY KEY,
    text TEXT NOT NULL UNIQUE CHECK (text <> '')
) STRICT;

CREATE TABLE families (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE CHECK (name <> ''),
    notes TEXT NOT NULL DEFAULT ''
) STRICT;

CREATE TABLE controllers (
    id INTEGER PRIMARY KEY,
    vendor TEXT NOT NULL CHECK (vendor <> ''),
    model TEXT NOT NULL CHECK (model <> ''),
    family_id INTEGER NOT NULL REFERENCES families (id),
    kind TEXT NOT NULL CHECK (kind IN ('plc', 'embedded')),
    notes TEXT NOT NULL DEFAULT '',
    UNIQUE (vendor, model)
) STRICT;

-- What is known in numbers and in words, each with who says it.
CREATE TABLE figures (
    controller_id INTEGER NOT NULL REFERENCES controllers (id) ON DELETE CASCADE,
    name TEXT NOT NULL,
    number INTEGER CHECK (number >= 0),
    text TEXT CHECK (text <> ''),
    source_id INTEGER NOT NULL REFERENCES sources (id),
    PRIMARY KEY (controller_id, name),
    CHECK ((number IS NULL) <> (text IS NULL))
) STRICT, WITHOUT ROWID;

-- How a family stores programs.
CREATE TABLE family_figures (
    family_id INTEGER NOT NULL REFERENCES families (id) ON DELETE CASCADE,
    name TEXT NOT NULL,
    number INTEGER NOT NULL CHECK (number >= 0),
    source_id INTEGER NOT NULL REFERENCES sources (id),
    PRIMARY KEY (family_id, name)
) STRICT, WITHOUT ROWID;

-- "Which have at least 24 inputs?" reads one range of this index.
CREATE INDEX figures_by_number ON figures (name, number, controller_id);
CREATE INDEX figures_by_source ON figures (source_id);
CREATE INDEX family_figures_by_source ON family_figures (source_id);
CREATE INDEX controllers_by_family ON controllers (family_id);
CREATE INDEX controllers_by_model ON controllers (model);

-- A model a line, for people and for reports; NULL is unknown. Prices are in hundredths.
CREATE VIEW controller_list AS
SELECT
    controllers.vendor, controllers.model, families.name AS family, controllers.kind,
    max(figures.number) FILTER (WHERE figures.name = 'digital_inputs') AS digital_inputs,
    max(figures.number) FILTER (WHERE figures.name = 'digital_outputs') AS digital_outputs,
    max(figures.number) FILTER (WHERE figures.name = 'analog_in') AS analog_in,
    max(figures.number) FILTER (WHERE figures.name = 'analog_out') AS analog_out,
    max(figures.number) FILTER (WHERE figures.name = 'program_memory_bytes') AS program_memory_bytes,
    max(figures.number) FILTER (WHERE figures.name = 'data_memory_bytes') AS data_memory_bytes,
    max(figures.number) FILTER (WHERE figures.name = 'timers') AS timers,
    max(figures.number) FILTER (WHERE figures.name = 'counters') AS counters,
    max(figures.number) FILTER (WHERE figures.name = 'bool_instruction_ns') AS bool_instruction_ns,
    max(figures.number) FILTER (WHERE figures.name = 'price') AS price_hundredths,
    max(figures.text) FILTER (WHERE figures.name = 'currency') AS currency,
    max(figures.text) FILTER (WHERE figures.name = 'comm_ports') AS comm_ports,
    max(figures.text) FILTER (WHERE figures.name = 'max_expansion_io') AS max_expansion_io,
    max(figures.text) FILTER (WHERE figures.name = 'languages') AS languages,
    controllers.notes
FROM controllers
JOIN families ON families.id = controllers.family_id
LEFT JOIN figures ON figures.controller_id = controllers.id
GROUP BY controllers.id;

-- Who says what.
CREATE VIEW provenance AS
SELECT controllers.vendor, controllers.model, figures.name AS figure, coalesce(figures.text, figures.number) AS value, sources.text AS source,
    controllers.notes
FROM figures
JOIN controllers ON controllers.id = figures.controller_id
JOIN sources ON sources.id = figures.source_id;

CREATE VIEW family_provenance AS
SELECT families.name AS family, family_figures.name AS figure, family_figures.number AS value, sources.text AS source, families.notes
FROM family_figures
JOIN families ON families.id = family_figures.family_id
JOIN sources ON sources.id = family_figures.source_id;
