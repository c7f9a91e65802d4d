"""What the parts of a scene's model are made of: strict numbers, names, refusals, and the frozen base of each part."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError


def refuse(sentence: str, *at: str | int, kind: str = "refused") -> PydanticCustomError:
    """A refusal that reads `<key> <sentence>`, pointing at a key below the one being validated."""
    return PydanticCustomError(kind, "{sentence}", {"sentence": sentence, "at": at})


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Count = Annotated[int, Field(strict=True)]
Name = Annotated[str, Field(strict=True, min_length=1)]


class Part(BaseModel):
    """A frozen piece of a scene that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid")
