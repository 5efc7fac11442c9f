"""What is looked at: plots, films, pages, the live picture."""
