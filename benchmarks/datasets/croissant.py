"""Croissant metadata (MLCommons, version 1.0) of a data set in the format of Minari."""

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileProperty": "cr:fileProperty",
    "fileObject": "cr:fileObject",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
"""Context that the standard prescribes."""
FILES = {"episodes": "main_data.hdf5", "metadata": "metadata.json"}
FORMATS = {".hdf5": "application/x-hdf5", ".json": "application/json"}
STEP = {"rewards": "sc:Float", "terminations": "sc:Boolean", "truncations": "sc:Boolean"}


def describe(folder: Path, metadata: Mapping[str, Any]) -> dict[str, Any]:
    """Return the metadata of the data set in a folder, from its own and Minari's metadata."""
    settings = metadata["settings"]
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": metadata["dataset_id"].replace("/", "-"),
        "description": (
            f"{metadata['total_steps']} control periods in {metadata['total_episodes']} episodes "
            f"of the simulated environment {settings['env']} (pneumatic artificial muscles); "
            f"behaviour: {settings['behaviour']}. SI units. Each episode has drawn its own plant "
            "parameters."
        ),
        "license": "https://spdx.org/licenses/MIT.html",
        "version": settings["pam_envs"],
        "citeAs": f"The pam-envs authors: pam-envs {settings['pam_envs']}",
        "creator": {"@type": "sc:Organization", "name": "The pam-envs authors"},
        "keywords": ["offline reinforcement learning", "control", "pneumatic artificial muscle"],
        "isLiveDataset": False,
        "distribution": list(_files(folder)),
        "recordSet": [_steps(metadata), _parameters(metadata)],
    }


def _files(folder: Path) -> Iterator[dict[str, Any]]:
    for name, file in FILES.items():
        path = folder / "data" / file
        content = path.read_bytes()
        yield {
            "@type": "cr:FileObject",
            "@id": name,
            "name": name,
            "contentUrl": f"data/{file}",
            "contentSize": f"{len(content)} B",
            "encodingFormat": FORMATS[path.suffix],
            "sha256": hashlib.sha256(content).hexdigest(),
        }


def _field(group: str, name: str, kind: str, text: str, column: str) -> dict[str, Any]:
    return {
        "@type": "cr:Field",
        "@id": f"{group}/{name}",
        "name": name,
        "description": text,
        "dataType": kind,
        "source": {"fileObject": {"@id": "episodes"}, "extract": {"column": column}},
    }


def _steps(metadata: Mapping[str, Any]) -> dict[str, Any]:
    """Return the columns of the steps; names and units are those of the environment's signals."""
    fields = []
    for part, signals in (("observations", "signals"), ("actions", "action_signals")):
        for signal in metadata[signals]:
            text = f"{signal['name']} [{signal['unit']}], {signal['low']:g} to {signal['high']:g}"
            column = f"{part}[:, {signal['index']}]"
            fields.append(_field("steps", f"{part}/{signal['name']}", "sc:Float", text, column))
    for name, kind in STEP.items():
        fields.append(_field("steps", name, kind, f"{name} of the steps", name))
    for name in ("output", "reference"):
        text = f"{name} that is scored, true value in SI units"
        fields.append(_field("steps", name, "sc:Float", text, f"infos/{name}"))
    return {
        "@type": "cr:RecordSet",
        "@id": "steps",
        "name": "steps",
        "description": "Groups episode_N of the file; observations and infos have one more entry.",
        "field": fields,
    }


def _parameters(metadata: Mapping[str, Any]) -> dict[str, Any]:
    """Return the columns of the episodes: split, seed, drawn parameters (privileged)."""
    fields = [
        _field("episodes_drawn", "split", "sc:Text", "train, validation or test", "@split"),
        _field("episodes_drawn", "seed", "sc:Integer", "seed of the episode's reset", "@seed"),
    ]
    for name, (low, high) in metadata["parameter_ranges"].items():
        text = f"privileged: {name} of the plant, drawn from {low:g} to {high:g} (SI units)"
        column = f"@parameters/{name}"
        fields.append(_field("episodes_drawn", name, "sc:Float", text, column))
    return {
        "@type": "cr:RecordSet",
        "@id": "episodes_drawn",
        "name": "episodes_drawn",
        "description": "Attributes of the groups episode_N.",
        "field": fields,
    }
