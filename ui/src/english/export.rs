//! Exporting: what is written.

use inplace_core::export::Format;

/// Name of the choice of a format.
pub const FORMAT: &str = "Format";
/// Name of the choice of class numbers.
pub const NUMBERS: &str = "Class numbers";
/// The project's numbers.
pub const OWN_NUMBERS: &str = "As in this project";
/// What other numbers mean.
pub const NUMBERS_EXPLAINED: &str = "Classes take the numbers, names and colours of that list by name; classes that are not in it become void.";
/// What is done with pixels that are not sure.
pub const UNCERTAIN: &str = "Uncertain pixels";
/// They become void.
pub const LEAVE_VOID: &str = "Void below a probability of";
/// Name of the slider beside it.
pub const LEAST_PROBABILITY: &str = "Least probability";

/// A format's name.
pub fn title(format: Format) -> &'static str {
    match format {
        Format::Png => "Label images",
        Format::Overlay => "Overlays",
        Format::Voc => "Pascal VOC, CVAT",
        Format::Cityscapes => "Cityscapes",
        Format::CocoPanoptic => "COCO panoptic",
        Format::CocoInstances => "COCO instances",
        Format::Labelme => "labelme",
        Format::HuggingFace => "Hugging Face",
        Format::PointCloud => "Point cloud",
        Format::Mesh => "Mesh",
    }
}

/// What a format is for, in a sentence or two.
pub fn description(format: Format) -> &'static str {
    match format {
        Format::Png => {
            "A PNG of class numbers, one of entropies and one of colours for every frame, and the list of classes."
        }
        Format::Overlay => "Every frame with the class colours half over it, as a JPEG, to look at.",
        Format::Voc => {
            "Images, class masks and object masks as Pascal VOC has them, and cvat.zip to upload to CVAT as \
             \"Segmentation mask 1.1\"."
        }
        Format::Cityscapes => "Label, instance and colour images as in the ground truth of Cityscapes.",
        Format::CocoPanoptic => {
            "panoptic.json and a PNG of segments for every frame: one segment for each class."
        }
        Format::CocoInstances => "instances.json with a mask for each connected region of a class.",
        Format::Labelme => "The images, and beside each a JSON of polygons to go on with in labelme.",
        Format::HuggingFace => {
            "Images, label images and metadata.jsonl, as load_dataset(\"imagefolder\") reads them."
        }
        Format::PointCloud => {
            "The surface as PLY, a point for each voxel with its class, in the capture's own coordinates: once in the \
             images' colours and once in the classes'."
        }
        Format::Mesh => {
            "The surface as PLY, triangles whose corners have classes, in the capture's own coordinates: once in the \
             images' colours and once in the classes'."
        }
    }
}

/// What is in the folder of an export, beside the strokes.
pub fn files(format: Format) -> &'static str {
    match format {
        Format::Png => "labels, entropy and color as PNGs; classes.json; strokes.json",
        Format::Overlay => "overlay as JPEGs; strokes.json",
        Format::Voc => "the data set; cvat.zip; strokes.json",
        Format::Cityscapes
        | Format::CocoPanoptic
        | Format::CocoInstances
        | Format::Labelme
        | Format::HuggingFace => "the data set; strokes.json",
        Format::PointCloud => "cloud.ply, cloud_classes.ply; classes.json; strokes.json",
        Format::Mesh => "mesh.ply, mesh_classes.ply; classes.json; strokes.json",
    }
}
