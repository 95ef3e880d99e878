"""One file a scene; see CONTRIBUTING.md."""
