"""Self-contained pages for the browser: their frame, colours and script."""
