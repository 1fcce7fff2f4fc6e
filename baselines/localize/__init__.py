"""A trained localizer on a person's own pictures."""
