"""Pages that a person reads: report, summary, published pages."""
