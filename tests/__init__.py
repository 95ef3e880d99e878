"""Tests: theorems, invariances and analytic answers rather than snapshots."""
