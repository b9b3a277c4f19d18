"""The page of settings, and the JSON Schema that it is made of."""

import importlib.util
import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from sdnn.cli import main
from sdnn.config import fields_of
from sdnn.runs.config_file import PAPER_ARGUMENTS, core_parts, spec_schema

SCRIPT = Path(__file__).parents[2] / "docs" / "write_settings.py"


def test_the_settings_page_is_up_to_date():
    spec = importlib.util.spec_from_file_location("write_settings", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.PAGE.read_text("utf-8") == module.page(), "run docs/write_settings.py"


def test_the_printed_json_schema_has_every_setting():
    schema = spec_schema()
    parts = [config for configs in core_parts().values() for config in configs]
    for config in (*parts, *PAPER_ARGUMENTS.values()):
        names = {field.name for field in fields_of(config)} - {"n_inputs"}
        assert set(schema["$defs"][config.__name__]["properties"]) == names
    printed = CliRunner().invoke(main, ["train", "--schema"])
    assert json.loads(printed.stdout) == json.loads(json.dumps(schema))


def test_the_json_schema_accepts_valid_and_rejects_invalid_files():
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(json.dumps(spec_schema()))
    jsonschema.validate({"environment": "CartPole-v1", "budget": {"steps": 5}}, schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"environment": "CartPole-v1", "budget": {"steps": 0}}, schema)
    task = {"id": "sdnn/PaperAcrobot-v0", "kwargs": {"sensors": {"n_sensors": 6}}}
    jsonschema.validate({"environment": task}, schema)
    task["kwargs"]["sensors"]["n_sensors"] = 7
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"environment": task}, schema)
