"""Files, tables, provenance, locks and timings: whatever is put on record."""
