"""The window of flyreg: everything that needs Qt or VTK.

The project changes in one place, `session.Session`; the pipeline runs in one thread,
`runner.Runner`; the five views show what came out of it, and the panels send edits.
"""
