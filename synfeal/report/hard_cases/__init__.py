"""The table of hard cases; those of the report's own statistics are here."""
