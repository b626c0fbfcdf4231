"""An episode as one page for the browser."""
