"""Pages for the browser that need nothing but themselves: their frame, colours and script."""
