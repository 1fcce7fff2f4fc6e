"""The paper: its design, stand-in rooms, tables, claims, figures and report."""
