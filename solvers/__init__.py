"""One file an algorithm; see CONTRIBUTING.md."""
