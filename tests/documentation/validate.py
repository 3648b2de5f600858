"""Validates the configurations of the repository against the schema, with a validator that knows nothing of the program.

Usage: validate.py SCHEMA WRONG.yaml...    the wrong ones must not be valid
"""

import pathlib
import sys

import jsonschema
import ruamel.yaml

schema_file, wrong = pathlib.Path(sys.argv[1]), sys.argv[2:]
reader = ruamel.yaml.YAML(typ="safe", pure=True)
schema = reader.load(schema_file)
jsonschema.Draft202012Validator.check_schema(schema)
validator = jsonschema.Draft202012Validator(schema)

# Studies have keys of their own.
scenes = [file for file in pathlib.Path("configs").rglob("*.yaml") if "studies" not in file.parts]
good = sorted([*scenes, *pathlib.Path("tests/good_input").glob("*.yaml")])
for file in good:
    text = file.read_text()
    problem = jsonschema.exceptions.best_match(validator.iter_errors(reader.load(text)))
    assert problem is None, f"{file}: {problem.json_path}: {problem.message}"
    if file.parts[0] == "configs" and "templates" not in file.parts:
        mark = "# yaml-language-server: $schema="
        named = [line.removeprefix(mark) for line in text.splitlines() if line.startswith(mark)]
        assert len(named) == 1, f"{file}: names no schema"
        assert (file.parent / named[0]).resolve() == schema_file.resolve(), f"{file}: {named[0]}"
for name in wrong:
    assert not validator.is_valid(reader.load(pathlib.Path(name).read_text())), f"{name} is valid"
print(f"{len(good)} configurations are valid, {len(wrong)} are not")
