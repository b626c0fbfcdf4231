"""The page of a test that was made smaller: before and after side by side."""
