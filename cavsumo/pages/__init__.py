"""What all pages share: the frame of the document, its colours, how a page is made."""
