CREATE TABLE project (
    id            INTEGER PRIMARY KEY CHECK (id = 1),
    scene         TEXT NOT NULL CHECK (scene IN ('demo', 'folder')),
    relative_path TEXT,
    absolute_path TEXT,
    depth         INTEGER NOT NULL,
    cursor        INTEGER NOT NULL,
    view          TEXT,
    written_by    TEXT NOT NULL,
    imported      INTEGER
) STRICT;
CREATE TABLE frame (
    number INTEGER PRIMARY KEY,
    stem   TEXT NOT NULL,
    width  INTEGER NOT NULL,
    height INTEGER NOT NULL,
    bytes  INTEGER NOT NULL,
    checked INTEGER
) STRICT;
CREATE TABLE class (
    position INTEGER PRIMARY KEY,
    id       INTEGER NOT NULL UNIQUE,
    name     TEXT NOT NULL,
    red      INTEGER NOT NULL,
    green    INTEGER NOT NULL,
    blue     INTEGER NOT NULL,
    thing    INTEGER
) STRICT;
CREATE TABLE stroke (
    id     INTEGER PRIMARY KEY,
    frame  INTEGER NOT NULL,
    class  INTEGER NOT NULL,
    radius INTEGER NOT NULL,
    lines  TEXT NOT NULL,
    object INTEGER
) STRICT;
CREATE TABLE edit (
    number INTEGER PRIMARY KEY,
    change TEXT NOT NULL
) STRICT;
CREATE TABLE model (
    id      INTEGER PRIMARY KEY CHECK (id = 1),
    steps   INTEGER NOT NULL,
    tensors BLOB NOT NULL
) STRICT;
CREATE TABLE map (
    frame      INTEGER PRIMARY KEY,
    generation INTEGER NOT NULL,
    labels     BLOB NOT NULL,
    entropy    BLOB NOT NULL
) STRICT;
