"""The paper's design as a table, and the files and jobs that follow from it."""
