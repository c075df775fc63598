"""Options of the study `incipient-slip`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class IncipientOptions(BaseModel):
    """What to look at, and how hard."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    path: str = Field(default="", description="folder with index.csv and videos")
    train: str = Field(default="", description="another such folder, to train on and test here")
    model: str = Field(default="shipped", description="simulation-trained detector (.onnx); 'shipped' or 'none'")
    slower: float = Field(
        default=3.0, ge=0.1, le=100, description="true frame interval over the nominal, for a model that knows m/s"
    )
    save_model: str = Field(default="", description="write the clip model, fitted on all of path, to this .onnx")
    cache: str = Field(default="", description="folder for what was read; empty for the user's own, 'none' for none")
    jobs: int = Field(default=1, ge=1, le=256, description="processes that read videos, and threads that train")
    repeats: int = Field(default=3, ge=1, le=50, description="times that objects are dealt out to folds anew")
    trees: int = Field(default=300, ge=10, le=5000, description="of the clip model")
