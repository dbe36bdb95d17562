"""What scripts read."""

Facts = dict[str, object]
"""Names and values as JSON has them; a length carries its unit in its name."""
