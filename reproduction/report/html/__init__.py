"""One page of HTML with everything a run has found; it opens offline and loads nothing."""
