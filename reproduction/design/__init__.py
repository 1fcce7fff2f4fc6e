"""The paper's design as a table, and what it asks of each stage."""
