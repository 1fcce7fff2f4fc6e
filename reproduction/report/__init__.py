"""What a person reads: page, document, summary, published pages."""
