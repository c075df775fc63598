"""The backends of this plugin."""

from lsds.contracts import BackendSpec
from lsds.registry import hookimpl


@hookimpl
def lsds_backends():
    """Return the one job."""
    return [
        BackendSpec("job", "place", "acme_place.job:PlaceJob", "acme_place.job:PlaceOptions", summary="put it back")
    ]
