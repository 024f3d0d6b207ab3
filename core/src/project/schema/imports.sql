CREATE TABLE import (
    id    INTEGER PRIMARY KEY,
    trust REAL NOT NULL CHECK (trust BETWEEN 0 AND 1)
) STRICT;
CREATE TABLE imported_map (
    import INTEGER NOT NULL,
    frame  INTEGER NOT NULL,
    labels BLOB NOT NULL,
    shares BLOB,
    objects BLOB,
    PRIMARY KEY (import, frame)
) STRICT;
