"""The report: tables, figures and summary from result files; it computes nothing upstream."""
