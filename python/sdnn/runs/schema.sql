CREATE TABLE runs (
  id INTEGER PRIMARY KEY,
  case_id TEXT NOT NULL, agent TEXT NOT NULL, trial INTEGER NOT NULL, seed INTEGER NOT NULL,
  config_hash TEXT NOT NULL, config TEXT NOT NULL, version TEXT NOT NULL,
  n_decisions INTEGER NOT NULL, seconds REAL NOT NULL,
  finished_at TEXT, -- NULL while it is in progress
  checksum TEXT NOT NULL, -- of its rows
  crc INTEGER NOT NULL, -- of the columns before this one
  UNIQUE (case_id, agent, trial, seed, config_hash)
);
CREATE TABLE rows (
  run_id INTEGER NOT NULL REFERENCES runs (id),
  number INTEGER NOT NULL, part INTEGER NOT NULL, kind TEXT NOT NULL, episode INTEGER NOT NULL,
  step INTEGER, length INTEGER NOT NULL, "return" REAL NOT NULL, terminated INTEGER NOT NULL,
  environment INTEGER,
  PRIMARY KEY (run_id, number, part)
) WITHOUT ROWID;
CREATE VIEW labelled_rows AS
  SELECT case_id, agent, trial, seed, config_hash, version, kind, episode, part, step, length,
         "return", terminated, environment
  FROM rows JOIN runs ON runs.id = rows.run_id;
CREATE TABLE measurements (
  kind TEXT NOT NULL, key TEXT NOT NULL, content TEXT NOT NULL,
  crc INTEGER NOT NULL, -- of the columns before this one
  PRIMARY KEY (kind, key)
) WITHOUT ROWID;
