"""What can go wrong in ways a user can cause; every message is a complete sentence for that user."""


class FlyregError(Exception):
    """Base of all errors whose message is meant for the user: what, where, the numbers, what to do."""


class InputError(FlyregError):
    """A file or template cannot be used as it is."""


class MeshError(FlyregError):
    """A surface is not what a stage needs."""


class TopologyError(FlyregError):
    """A brain or a half of it does not have the shape the method needs (a torus, a ring)."""


class LandmarkError(FlyregError):
    """Landmarks, weights or smoothing cannot be used."""


class ProjectError(FlyregError):
    """A project file cannot be used."""


class Cancelled(Exception):
    """The work was stopped on request; nothing is wrong."""
