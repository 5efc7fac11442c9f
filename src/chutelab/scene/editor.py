"""The JSON Schema of scene files, for editors that complete and check TOML while one types."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue

from chutelab.scene.models import Scene

if TYPE_CHECKING:
    from pydantic_core import core_schema


class _TomlSchema(GenerateJsonSchema):
    """TOML has no null: an optional key is left out, so null is neither offered nor a default."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        described = super().default_schema(schema)
        if described.get("default", 0) is None:
            del described["default"]
        return described

    def field_title_should_be_set(self, schema: Any) -> bool:
        # "Pulley Radius" for pulley_radius says nothing that the key does not.
        return False


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of scene files.

    With the Even Better TOML extension or taplo, the first line ``#:schema ./scene.schema.json``
    of a scene connects the two. Quantities carry their unit as ``x-unit`` too.
    """
    described = Scene.model_json_schema(by_alias=True, schema_generator=_TomlSchema)
    described["title"] = "Chutelab scene"
    described["dependentRequired"] = {"plate": ["incoming"], "outgoing": ["incoming"]}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **described}
