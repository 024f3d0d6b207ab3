"""Opens exports with the programs that they are made for and compares them with the plain format.

    python check.py FOLDER

FOLDER has an export in each format, in a folder of the format's name. Classes, pixels and areas of every frame have to
be those of png/labels, points and triangles those of surface.json. In FOLDER/objects the same formats have objects: those of
png/objects and png/objects.json. Ends with 1 and a line for each difference.
"""

import importlib.machinery
import json
import os
import sys
import zipfile
from pathlib import Path
from unittest.mock import MagicMock

import cv2
import numpy as np
from loguru import logger
from PIL import Image, ImageDraw, ImageOps
from plyfile import PlyData
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO

# labelme draws with these; reading and painting shapes does not need them.
for name in ("onnxruntime", "imgviz", "imgviz.io", "PyQt5"):
    stand_in = MagicMock(__spec__=importlib.machinery.ModuleSpec(name, None))
    sys.modules[name] = stand_in

# pyquaternion is for boxes of cars.
sys.modules["pyquaternion"] = MagicMock()
os.environ["HF_HUB_OFFLINE"] = "1"

import datasets  # noqa: E402
import labelme  # noqa: E402
from cityscapesscripts.evaluation.instances2dict import instances2dict  # noqa: E402
from datumaro.plugins.data_formats.coco.base import CocoPanopticBase  # noqa: E402

logger.disable("labelme")
datasets.disable_progress_bars()


class Plain:
    """The export in the plain format."""

    def __init__(self, folder: Path):
        classes = json.loads((folder / "classes.json").read_text("utf-8"))
        self.names = {record["id"]: record["name"] for record in classes}
        self.colors = {record["id"]: tuple(record["color"]) for record in classes}
        paths = sorted((folder / "labels").glob("*.png"))
        assert paths, f"{folder} has no labels"
        self.labels = {path.stem: np.array(Image.open(path)).astype(int) for path in paths}
        shown = set().union(*(np.unique(labels) for labels in self.labels.values())) - {0}
        assert len(shown) > 3, "too few classes to tell anything"


def same(what: str, found, expected) -> None:
    """Two arrays, or numbers, are equal."""
    if isinstance(expected, np.ndarray):
        assert found.shape == expected.shape, f"{what}: {found.shape} instead of {expected.shape}"
        wrong = int((found != expected).sum())
        assert wrong == 0, f"{what}: {wrong} of {expected.size} pixels differ"
    else:
        assert found == expected, f"{what}: {found} instead of {expected}"


def rgb(path: Path) -> np.ndarray:
    """Colours of an image, [height, width, 3]."""
    return np.array(Image.open(path).convert("RGB")).astype(int)


def check_image(path: Path, labels: np.ndarray) -> None:
    """An image can be decoded and has the size of its labels, whether its orientation is followed or not."""
    with Image.open(path) as image:
        image.load()
        same(str(path), image.size[::-1], labels.shape)
        same(f"{path} turned", np.array(ImageOps.exif_transpose(image)), np.array(image))


def overlay(folder: Path, plain: Plain) -> None:
    """The colours half over the images, up to what compressing them costs; both alone are 40 off and more."""
    for stem, labels in plain.labels.items():
        path = folder / "overlay" / f"{stem}.jpg"
        check_image(path, labels)
        (image,) = (folder.parent / "voc/JPEGImages").glob(f"{stem}.*")
        expected = rgb(image)
        for id, color in plain.colors.items():
            expected[labels == id] = (expected[labels == id] + color) // 2
        off = np.abs(rgb(path) - expected).mean()
        assert off < 15, f"{path} is {off} off"
    same("overlays", len(list((folder / "overlay").iterdir())), len(plain.labels))


def label_map(text: str) -> list[tuple[str, tuple[int, ...]]]:
    """Names and colours of a labelmap.txt, as VOC's readers split it."""
    lines = [line.strip() for line in text.splitlines()]
    fields = [line.split(":") for line in lines if line and not line.startswith("#")]
    assert all(len(of_line) == 4 for of_line in fields), "four fields a line"
    return [(name, tuple(map(int, color.split(",")))) for name, color, _, _ in fields]


def voc(folder: Path, plain: Plain) -> None:
    entries = label_map((folder / "labelmap.txt").read_text("utf-8"))
    same("the first label", entries[0], ("background", (0, 0, 0)))
    colors = [color for _, color in entries]
    same("distinct colours", len(set(colors)), len(colors))
    id_of = {name: id for id, name in plain.names.items()} | {"background": 0}
    ids = np.array([id_of[name] for name, _ in entries])
    stems = (folder / "ImageSets/Segmentation/default.txt").read_text("utf-8").splitlines()
    same("frames", sorted(stems), sorted(plain.labels))
    for stem, labels in plain.labels.items():
        images = list((folder / "JPEGImages").glob(f"{stem}.*"))
        same(f"images of {stem}", len(images), 1)
        check_image(images[0], labels)
        path = folder / "SegmentationClass" / f"{stem}.png"
        with Image.open(path) as image:
            same(f"{path} kind", image.mode, "P")
            same(f"{path} by indices", ids[np.array(image)], labels)
        by_color = np.zeros_like(labels)
        painted = rgb(path)
        for (_, color), id in zip(entries, ids):
            by_color[(painted == color).all(axis=2)] = id
        same(f"{path} by colours", by_color, labels)
        # An object is of one class, and what is of no object is of none.
        objects = np.array(Image.open(folder / "SegmentationObject" / f"{stem}.png"))
        same(f"{stem}: void objects", objects == 0, labels == 0)
        for number in np.unique(objects):
            same(f"{stem}: classes of object {number}", len(np.unique(labels[objects == number])), 1)
    with zipfile.ZipFile(folder / "cvat.zip") as archive:
        same("spoilt files in cvat.zip", archive.testzip(), None)
        same("files in cvat.zip", len(archive.namelist()), 2 + 2 * len(plain.labels))
        for name in archive.namelist():
            assert archive.read(name) == (folder / name).read_bytes(), f"{name} differs in cvat.zip"


def cityscapes(folder: Path, plain: Plain) -> None:
    for stem, labels in plain.labels.items():
        images = {
            kind: np.array(Image.open(folder / "gtFine" / f"{stem}_gtFine_{kind}.png")).astype(int)
            for kind in ("labelIds", "instanceIds", "color")
        }
        same(f"{stem} labelIds", images["labelIds"], labels)
        # As cityscapesScripts takes an instance apart.
        instances = images["instanceIds"]
        same(f"{stem} instanceIds", np.where(instances < 1000, instances, instances // 1000), labels)
        assert (instances >= 1000).any(), f"{stem} has no instances"
        for id, color in plain.colors.items():
            # A region of a class is an instance.
            count, regions = cv2.connectedComponents((labels == id).astype(np.uint8), connectivity=8)
            pairs = np.unique(np.stack([regions, instances])[:, labels == id], axis=1)
            same(f"{stem} regions", (pairs.shape[1], len(np.unique(pairs[1]))), (count - 1, count - 1))
            same(f"{stem} color", (images["color"][labels == id] == color).all(), np.True_)


def categories(listed: list[dict], plain: Plain, isthing: int) -> None:
    same("categories", {one["id"]: one["name"] for one in listed}, plain.names)
    assert all(one["supercategory"] and one["isthing"] == isthing for one in listed), "categories"


def coco_panoptic(folder: Path, plain: Plain) -> None:
    panoptic = json.loads((folder / "panoptic.json").read_text("utf-8"))
    categories(panoptic["categories"], plain, 0)
    images = {image["id"]: image for image in panoptic["images"]}
    same("images", len(images), len(plain.labels))
    same("annotations", len(panoptic["annotations"]), len(plain.labels))
    for annotation in panoptic["annotations"]:
        image = images[annotation["image_id"]]
        labels = plain.labels[Path(image["file_name"]).stem]
        check_image(folder / "images" / image["file_name"], labels)
        colors = rgb(folder / "panoptic" / annotation["file_name"])
        # As panopticapi's rgb2id.
        ids = colors[..., 0] + 256 * colors[..., 1] + 65536 * colors[..., 2]
        found = np.zeros_like(labels)
        for segment in annotation["segments_info"]:
            of_segment = ids == segment["id"]
            found[of_segment] = segment["category_id"]
            same(f"{image['file_name']} area", segment["area"], int(of_segment.sum()))
            rows, columns = np.nonzero(of_segment)
            width, height = int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1
            bbox = [int(columns.min()), int(rows.min()), width, height]
            same(f"{image['file_name']} bbox", segment["bbox"], bbox)
        same(f"{image['file_name']} segments", found, labels)


def coco_instances(folder: Path, plain: Plain) -> None:
    coco = COCO(folder / "instances.json")
    categories(coco.loadCats(coco.getCatIds()), plain, 1)
    same("images", len(coco.getImgIds()), len(plain.labels))
    for image in coco.loadImgs(coco.getImgIds()):
        name = image["file_name"]
        labels = plain.labels[Path(name).stem]
        check_image(folder / "images" / name, labels)
        found, covered = np.zeros_like(labels), np.zeros_like(labels)
        for annotation in coco.loadAnns(coco.getAnnIds(imgIds=image["id"])):
            mask = coco.annToMask(annotation).astype(bool)
            runs = annotation["segmentation"]
            same(f"{name} area", annotation["area"], int(coco_mask.area(runs)))
            same(f"{name} bbox", annotation["bbox"], coco_mask.toBbox(runs).tolist())
            found[mask] = annotation["category_id"]
            covered += mask
        same(f"{name} masks", found, labels)
        same(f"{name} masks do not overlap", covered, (labels != 0).astype(int))


def labelme_files(folder: Path, plain: Plain) -> None:
    values = {name: id for id, name in plain.names.items()} | {"_background_": 0}
    for stem, labels in plain.labels.items():
        # It reads the image too, and complains when its size is another.
        file = labelme.LabelFile(str(folder / "labelme" / f"{stem}.json"))
        assert file.image_data, f"{stem} has no image"
        painted, _ = labelme.utils.shapes_to_label(labels.shape, file.shapes, values)
        same(f"{stem} shapes", painted, labels)


def hugging_face(folder: Path, plain: Plain) -> None:
    """The documented layout of `imagefolder`: file names are relative to metadata.jsonl."""
    names = {int(id): name for id, name in json.loads((folder / "id2label.json").read_text("utf-8")).items()}
    same("names", names, plain.names | {0: "void"})
    rows = [json.loads(row) for row in (folder / "metadata.jsonl").read_text("utf-8").splitlines()]
    same("rows", len(rows), len(plain.labels))
    for row in rows:
        labels = plain.labels[Path(row["label_file_name"]).stem]
        check_image(folder / row["file_name"], labels)
        same(row["label_file_name"], np.array(Image.open(folder / row["label_file_name"])).astype(int), labels)
        same(f"{row['file_name']} classes", set(row["classes"]), {names[id] for id in np.unique(labels) if id})


def yolo(folder: Path, plain: Plain) -> None:
    """Polygons painted one after the other; holes of void are filled."""
    lines = (folder / "data.yaml").read_text("utf-8").splitlines()
    names = lines[lines.index("names:") + 1 :]
    same("names", [json.loads(name.split(": ", 1)[1]) for name in names], list(plain.names.values()))
    ids = list(plain.names)
    for stem, labels in plain.labels.items():
        images = list((folder / "images").glob(f"{stem}.*"))
        same(f"images of {stem}", len(images), 1)
        check_image(images[0], labels)
        painted = Image.new("I", labels.shape[::-1])
        draw = ImageDraw.Draw(painted)
        for line in (folder / "labels" / f"{stem}.txt").read_text().splitlines():
            place, *points = line.split()
            points = np.array(points, float).reshape(-1, 2)
            assert len(points) > 2 and (points > 0).all() and (points < 1).all(), f"{stem}: {line}"
            pixels = np.floor(points * painted.size).astype(int)
            draw.polygon([tuple(pixel) for pixel in pixels.tolist()], fill=ids[int(place)], outline=ids[int(place)])
        same(f"{stem} polygons", np.where(labels == 0, 0, np.array(painted)), labels)


def ply(path: Path, expected: dict, colors: list, plain: Plain) -> None:
    """Vertices, with everything that they have, and faces are the expected ones; the header lists the classes."""
    read = PlyData.read(path)
    vertices = read["vertex"]
    same(f"{path} vertices", vertices.count, len(expected["labels"]))
    for keys, values in [
        (["x", "y", "z"], expected["positions"]),
        (["red", "green", "blue"], colors),
        (["label"], expected["labels"]),
        (["entropy"], expected["entropy"]),
    ]:
        found = np.stack([vertices[key] for key in keys], axis=-1)
        # Entropy is written in single precision.
        wanted = np.array(values).reshape(found.shape).astype(found.dtype)
        same(f"{path} {' '.join(keys)}", found, wanted)
    normals = np.stack([vertices[key] for key in ("nx", "ny", "nz")], axis=-1)
    lengths = np.linalg.norm(normals, axis=-1)
    assert (np.isclose(lengths, 1, atol=1e-3) | (lengths == 0)).all(), f"{path}: normals are not of unit length"
    ids, counts = np.unique(vertices["label"], return_counts=True)
    wanted = {int(id): count for id, count in expected["classes"].items()}
    same(f"{path} vertices of each class", dict(zip(ids.tolist(), counts.tolist())), wanted)
    listed = [comment.split(" ", 2)[1:] for comment in read.comments if comment.startswith("class ")]
    same(f"{path} classes", {int(id): name for id, name in listed}, plain.names)
    faces = list(read["face"]["vertex_indices"]) if "face" in read else []
    found = np.stack(faces) if faces else np.zeros((0, 3), int)
    same(f"{path} faces", found, np.array(expected["triangles"], int).reshape(-1, 3))


def solid(folder: Path, plain: Plain) -> None:
    """The points or the triangles of the surface, in the images' colours and in those of the classes."""
    name = {"point-cloud": "cloud", "mesh": "mesh"}[folder.name]
    expected = json.loads((folder.parent / "surface.json").read_text("utf-8"))[name]
    assert len(expected["classes"]) > 3, "too few classes to tell anything"
    ply(folder / f"{name}.ply", expected, expected["colors"], plain)
    class_color = plain.colors | {0: (0, 0, 0)}
    colors = [class_color[id] for id in expected["labels"]]
    ply(folder / f"{name}_classes.ply", expected, colors, plain)


class Objects:
    """The things of the export in the plain format."""

    def __init__(self, folder: Path):
        self.listed = (folder / "objects.json").read_bytes()
        records = json.loads(self.listed)
        self.classes = {record["id"]: record["class_id"] for record in records if record["thing"]}
        listed = json.loads((folder / "classes.json").read_text("utf-8"))
        self.things = {record["id"]: int(record["thing"]) for record in listed}
        paths = sorted((folder / "objects").glob("*.png"))
        self.images = images = {path.stem: np.array(Image.open(path)).astype(int) for path in paths}
        # Pixels of each thing in each frame.
        self.pixels = {
            stem: {id: int((image == id).sum()) for id in self.classes if (image == id).any()}
            for stem, image in images.items()
        }
        assert len(self.classes) > 5, "too few objects to tell anything"
        several = [id for id in self.classes if sum(id in of_frame for of_frame in self.pixels.values()) > 1]
        assert several, "no object is in several frames"


def voc_objects(folder: Path, objects: Objects) -> None:
    for stem, pixels in objects.pixels.items():
        found = np.array(Image.open(folder / "SegmentationObject" / f"{stem}.png"))
        for id, area in pixels.items():
            (number,) = np.unique(found[objects.images[stem] == id])
            same(f"{stem}: pixels of object {id}", int((found == number).sum()), area)


def cityscapes_objects(folder: Path, objects: Objects) -> None:
    found = {}
    for stem, pixels in objects.pixels.items():
        instances = instances2dict([str(folder / "gtFine" / f"{stem}_gtFine_instanceIds.png")])
        (by_class,) = instances.values()
        own = [one for of_class in by_class.values() for one in of_class if one["instID"] >= 1000]
        areas = sorted((one["labelID"], one["pixelCount"]) for one in own)
        same(f"{stem} instances", areas, sorted((objects.classes[id], area) for id, area in pixels.items()))
        found |= {one["instID"]: one["labelID"] for one in own}
    same("instances", sorted(found.values()), sorted(objects.classes.values()))


def panoptic_objects(folder: Path, objects: Objects) -> None:
    panoptic = json.loads((folder / "panoptic.json").read_text("utf-8"))
    same("things", {one["id"]: one["isthing"] for one in panoptic["categories"]}, objects.things)
    segments = [segment for one in panoptic["annotations"] for segment in one["segments_info"]]
    same("crowds", {segment["iscrowd"] for segment in segments if segment["id"] >= 65536}, {0})
    # It looks for a folder of this name.
    root = folder.parent / "datumaro"
    root.mkdir()
    (root / "annotations").symlink_to(folder)
    (root / "images").symlink_to(folder / "images")
    items = list(CocoPanopticBase(str(root / "annotations/panoptic.json"), subset="all"))
    same("items", {item.id for item in items}, set(objects.pixels))
    for item in items:
        own = [mask for mask in item.annotations if mask.id >= 65536]
        found = {mask.id - 65536: int(mask.image.sum()) for mask in own}
        same(f"{item.id} segments", found, objects.pixels[item.id])


def instances_objects(folder: Path, objects: Objects) -> None:
    coco = COCO(folder / "instances.json")
    same("things", {id: one["isthing"] for id, one in coco.cats.items()}, objects.things)
    for image in coco.loadImgs(coco.getImgIds()):
        annotations = coco.loadAnns(coco.getAnnIds(imgIds=image["id"]))
        own = [one for one in annotations if "object_id" in one]
        found = {one["object_id"]: int(coco.annToMask(one).sum()) for one in own}
        same(f"{image['file_name']} objects", found, objects.pixels[Path(image["file_name"]).stem])


def labelme_objects(folder: Path, objects: Objects) -> None:
    for stem, pixels in objects.pixels.items():
        shapes = labelme.LabelFile(str(folder / "labelme" / f"{stem}.json")).shapes
        groups = {shape["group_id"] for shape in shapes} - {None}
        same(f"{stem} groups", groups, set(pixels))


def hugging_face_objects(folder: Path, objects: Objects) -> None:
    cache = str(folder.parent / "cache")
    loaded = datasets.load_dataset("imagefolder", data_dir=str(folder), split="train", cache_dir=cache)
    same("rows", len(loaded), len(objects.pixels))
    found = []
    for row in loaded:
        image = np.array(row["objects"]).astype(int)
        found.append({id: int((image == id).sum()) for id in objects.classes if (image == id).any()})
    same("objects", found, [objects.pixels[stem] for stem in sorted(objects.pixels)])
    same("list of objects", (folder / "objects.json").read_bytes(), objects.listed)


def solid_objects(folder: Path, objects: Objects) -> None:
    name = {"point-cloud": "cloud", "mesh": "mesh"}[folder.name]
    read = PlyData.read(folder / f"{name}.ply")
    listed = [comment.split(" ", 2)[1] for comment in read.comments if comment.startswith("object ")]
    assert set(objects.classes) <= {int(id) for id in listed}, "not all objects are listed"
    for id, class_id in objects.classes.items():
        labels = read["vertex"]["label"][read["vertex"]["object"] == id]
        assert len(labels) and (labels == class_id).all(), f"points of object {id}"


def boxes(folder: Path, objects: Objects) -> None:
    """Boxes have most points of their object inside, in both coordinates, which differ in unit and axes at most."""
    records = json.loads((folder / "boxes.json").read_text("utf-8"))
    vertices = PlyData.read(folder / "pointclouds/cloud.ply")["vertex"]
    lines = [line.split() for line in (folder / "labels/cloud.txt").read_text().splitlines()]
    same("lines", len(lines), len(records))
    assert set(objects.classes) <= {record["id"] for record in records}, "an object has no box"
    places = np.stack([vertices[key] for key in "xyz"], axis=-1)
    for record, line in zip(records, lines):
        same("class", line[0], record["class_name"].replace(" ", "_"))
        height, width, length, *center, yaw = map(float, line[8:])
        assert np.allclose(np.sort([length, width, height]), np.sort(record["size"]), atol=1e-3), record
        cos, sin = np.cos(yaw), np.sin(yaw)
        own = places[vertices["object"] == record["id"]] - center
        same("points", len(own), record["points"])
        turned = own @ np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
        inside = (np.abs(turned) <= 0.5 * np.array([length, width, height]) + 1e-3).all(axis=1)
        assert inside.mean() > 0.9 or len(own) < 10, f"{record}: {inside.mean()}"
        same("a rotation", bool(np.allclose(np.linalg.det(record["rotation"]), 1)), True)


# What is checked of each format: its classes, and its objects.
FORMATS = {
    "overlay": (overlay, None),
    "voc": (voc, voc_objects),
    "cityscapes": (cityscapes, cityscapes_objects),
    "coco-panoptic": (coco_panoptic, panoptic_objects),
    "coco-instances": (coco_instances, instances_objects),
    "labelme": (labelme_files, labelme_objects),
    "yolo": (yolo, None),
    "hugging-face": (hugging_face, hugging_face_objects),
    "point-cloud": (solid, solid_objects),
    "mesh": (solid, solid_objects),
    "boxes": (None, boxes),
}


def main() -> int:
    root = Path(sys.argv[1])
    plain, things = Plain(root / "png"), Objects(root / "objects/png")
    checks = [(name, of_classes, root / name, plain) for name, (of_classes, _) in FORMATS.items()]
    checks += [(f"{name} of objects", check, root / "objects" / name, things) for name, (_, check) in FORMATS.items()]
    failed = 0
    for name, check, folder, expected in checks:
        if check is None:
            continue
        try:
            check(folder, expected)
            print(f"{name} is right")
        except (AssertionError, KeyError, OSError, ValueError, labelme._label_file.LabelFileError) as error:
            print(f"{name}: {type(error).__name__}: {error}", file=sys.stderr)
            failed = 1
    return failed


if __name__ == "__main__":
    sys.exit(main())
