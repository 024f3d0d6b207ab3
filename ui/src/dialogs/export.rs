//! Asking what is exported, and where to.

use egui::{Slider, Ui};
use inplace_core::export::Format;
use inplace_core::labels::PALETTES;
use inplace_model::dialogs::{ExportChoice, Purpose};
use inplace_model::{Command, Commands};

use super::form::{browse, confirm, path_field};
use crate::widgets::{choice_box, weak_text};

/// Per cent below which a class is left away where that is asked for first: it is no better than a guess.
const FIRST_THRESHOLD: u8 = 50;

pub fn show(ui: &mut Ui, choice: &mut ExportChoice, commands: &mut Commands) {
    let entered = path_field(ui, &mut choice.path, "Export folder");
    browse(ui, "Browse...", Purpose::Export, commands);
    ui.add_space(4.0);
    egui::Grid::new("export")
        .num_columns(2)
        .spacing([16.0, 8.0])
        .show(ui, |ui| {
            ui.label("Format");
            format(ui, choice);
            ui.end_row();
            ui.label("Class numbers");
            numbers(ui, choice);
            ui.end_row();
            ui.label("Uncertain pixels");
            threshold(ui, choice);
            ui.end_row();
        });
    weak_text(ui, description(choice.format));
    if choice.ids.is_some() {
        weak_text(
            ui,
            "Classes take the numbers, names and colours of that list by name; classes that are not in it become void.",
        );
    }
    let possible = !choice.path.trim().is_empty();
    confirm(ui, "Export", possible, entered, commands, || {
        Command::Export(choice.clone())
    });
}

fn format(ui: &mut Ui, choice: &mut ExportChoice) {
    choice_box(ui, "Format", 220.0, title(choice.format), |ui| {
        for format in Format::ALL {
            ui.selectable_value(&mut choice.format, format, title(format));
        }
    });
}

fn numbers(ui: &mut Ui, choice: &mut ExportChoice) {
    let chosen = choice.ids.map_or("As in this project", |palette| palette.name);
    choice_box(ui, "Class numbers", 220.0, chosen, |ui| {
        ui.selectable_value(&mut choice.ids, None, "As in this project");
        for palette in &PALETTES {
            ui.selectable_value(&mut choice.ids, Some(palette), palette.name);
        }
    });
}

fn threshold(ui: &mut Ui, choice: &mut ExportChoice) {
    ui.horizontal(|ui| {
        let mut is_set = choice.least_percent.is_some();
        if ui.checkbox(&mut is_set, "Void below a probability of").changed() {
            choice.least_percent = is_set.then_some(FIRST_THRESHOLD);
        }
        if let Some(percent) = &mut choice.least_percent {
            let slider = Slider::new(percent, 1..=99).suffix(" %");
            ui.add(slider).accessible_name("Least probability");
        }
    });
}

/// What a format is for, in a sentence or two.
fn description(format: Format) -> &'static str {
    match format {
        Format::Png => {
            "A PNG of class numbers, one of entropies and one of colours for every frame, and the list of classes; where a \
             class is a thing, also a PNG of object numbers for every frame, and the list of objects."
        }
        Format::Overlay => "Every frame with the class colours half over it, as a JPEG, to look at.",
        Format::Voc => {
            "Images, class masks and object masks as Pascal VOC has them, and cvat.zip to upload to CVAT as \
             \"Segmentation mask 1.1\"."
        }
        Format::Cityscapes => "Label, instance and colour images as in the ground truth of Cityscapes.",
        Format::CocoPanoptic => {
            "panoptic.json and a PNG of segments for every frame: one segment for each object, and one for each class that \
             is stuff."
        }
        Format::CocoInstances => {
            "instances.json with a mask for each object of a frame, and one for each region of stuff."
        }
        Format::Labelme => "The images, and beside each a JSON of polygons to go on with in labelme.",
        Format::Yolo => {
            "Images, polygons of their regions and data.yaml, as the segmentation of YOLO reads them."
        }
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
        Format::Boxes => {
            "boxes.json: an upright box around each object, in the capture's own coordinates. With the points and labels \
             that labelCloud opens."
        }
    }
}

fn title(format: Format) -> &'static str {
    match format {
        Format::Png => "Label images",
        Format::Overlay => "Overlays",
        Format::Voc => "Pascal VOC, CVAT",
        Format::Cityscapes => "Cityscapes",
        Format::CocoPanoptic => "COCO panoptic",
        Format::CocoInstances => "COCO instances",
        Format::Labelme => "labelme",
        Format::Yolo => "YOLO",
        Format::HuggingFace => "Hugging Face",
        Format::PointCloud => "Point cloud",
        Format::Mesh => "Mesh",
        Format::Boxes => "3D boxes",
    }
}
