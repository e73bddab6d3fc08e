"""What is chosen and what is found, as plain values that go through pipes: no page, no process, no model."""
