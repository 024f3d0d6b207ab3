//! What a person can ask for. Views push commands; [`crate::Model::update`] carries them out.

use std::path::PathBuf;
use std::sync::Arc;

use inplace_core::guide::audit::Verdict;
use inplace_core::labels::{Class, ClassId, FoundObject, Label, ObjectId, Pixel, StrokeId, Trust};
use inplace_core::scene::{SceneSource, Viewpoint};
use inplace_core::semantics::KnownPart;

use crate::class_view::Named;
use crate::dialogs::{ClassUse, Dialog, ExportChoice, Purpose};
use crate::frames::{FrameFilter, FrameOrder};
use crate::layer::Layer;
use crate::model::Side;
use crate::opening::Target;
use crate::preferences::{PreferenceChange, RecentPlace};
use crate::space::Space;
use crate::tool::{DrawnLine, Tool};
use crate::view::View;
use crate::workspace::Chosen;

/// One thing to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Opens a capture or a project.
    Open(Target),
    /// Takes a file or a folder that was dropped onto the window.
    Dropped(PathBuf),
    /// Saves to the project file; asks where if there is none yet.
    Save,
    /// Saves to another project file.
    SaveTo(PathBuf),
    /// The same, in place of what is there.
    ReplaceFile(PathBuf),
    /// Writes a data set into a folder.
    Export(ExportChoice),
    /// Stops the export that is under way.
    CancelExport,
    /// Takes over the label images of a folder, believed so far.
    ImportFrom(PathBuf, Trust),
    /// Drops the import whose images are being read.
    CancelImport,
    /// Compares the scene with another project of it.
    CompareWith(PathBuf),
    /// Stops reading the project that is to be compared with.
    CancelComparison,
    /// Ends the comparison with another project.
    EndComparison,
    /// Removes the label images that were imported.
    RemoveImported,
    /// Shows a folder in the file manager.
    ShowFolder(PathBuf),
    /// Asks for a path with the system's dialog.
    Browse(Purpose),
    /// Shows a dialog, or closes the one shown.
    Show(Option<Dialog>),
    /// The person typed or chose something in the dialog shown; one of another kind is left alone.
    Edit(Dialog),
    /// Goes back to the start page; labels that are on no disk are lost only when one insists.
    CloseScene,
    /// Keeps what can be kept, as the window is gone.
    End,
    /// Closes the window.
    Quit,
    /// The system asks to close the window.
    CloseWindow,

    /// A line was drawn on the frame in view.
    Draw(DrawnLine),
    /// The same, on a new object of the current class; what strokes say stays as it is.
    DrawObject(DrawnLine),
    /// Selects a stroke where it is, or none.
    SelectStroke(Option<StrokeId>),
    /// Shows a stroke and selects it.
    GoToStroke(StrokeId),
    /// Deletes a stroke.
    DeleteStroke(StrokeId),
    /// Deletes the selected stroke.
    DeleteSelected,
    /// Gives a stroke another class, which may be void.
    ChangeStrokeClass(StrokeId, ClassId),
    /// Labels the part of what a click would win that is outlined at the pointer.
    LabelOutlined,
    /// Labels the place of the surface that a frame (by its index) shows at a pixel, as what was chosen when it was clicked
    /// on, and stays where one is.
    LabelSeen(usize, Pixel, Chosen),
    /// Marks the frame in view as checked, or takes the mark away.
    ToggleChecked,
    /// Takes the last edit back.
    Undo,
    /// Does the last undone edit again.
    Redo,

    /// Adds a class of this name, does something with it, and applies the click that waited for it.
    AddClass(ClassUse, String),
    /// Makes a class current. With an object, its class becomes current, and from now on, strokes say the object.
    Choose(Named),
    /// Labels the suggestion at hand with the n-th class of the list, or makes that current; 0 is void.
    ChooseSlot(usize),
    /// Gives a class or an object another name.
    Rename(Named, String),
    /// Gives a class another colour.
    RecolorClass(ClassId, [u8; 3]),
    /// From now on, strokes of the current class say a new object of it.
    SayNewObject,
    /// Makes the first object a part of the second.
    MergeObject(ObjectId, ObjectId),
    /// Shows an object in the frame that has most of its pixels.
    GoToObject(ObjectId),
    /// These are the objects of the scene, as far as they are looked for, and those of them that no stroke names, to find them
    /// again; no person asks for it.
    SeeObjects(Arc<[FoundObject]>, Arc<[KnownPart]>),
    /// Lists the objects of a class below it, or the class alone.
    UnfoldClass(ClassId, bool),
    /// Makes a class one of things, which have objects, or stuff.
    SetClassThing(ClassId, bool),
    /// Deletes a class and its strokes, or an object, whose strokes say only the class then.
    Delete(Named),
    /// Gives all strokes of the first class to the second.
    MergeClass(ClassId, ClassId),

    /// Adds classes of a data set or a file, those of them that are not there yet.
    AddClasses(Vec<Class>),
    /// Moves a class to a place of the list, counted without it.
    MoveClass(ClassId, usize),
    /// Locks a class or an object, or unlocks it.
    SetLocked(Named, bool),
    /// Hides a class or an object in the overlay, or shows it again.
    SetHidden(Named, bool),
    /// Shows the layer of objects with this one alone, or again with all others.
    ShowOnly(ObjectId, bool),
    /// Unlocks all classes and objects.
    UnlockAll,
    /// Shows all classes and objects in the overlay.
    ShowAll,
    /// Lets the person find a class by typing.
    FindClass(ClassUse),
    /// Does something with the class that was found.
    UseClass(ClassUse, ClassId),
    /// Reads a class list for the dialog that adds classes.
    ReadClasses(PathBuf),
    /// Writes the classes to a file.
    SaveClassesTo(PathBuf),

    /// Shows a frame.
    GoToFrame(usize),
    /// Shows the frame so many places from the one in view, among those that the filmstrip shows.
    StepFrame(isize),
    /// Shows the frame with this number or name.
    FindFrame(String),
    /// Chooses which frames the filmstrip shows.
    FilterFrames(FrameFilter),
    /// Chooses the order of the filmstrip.
    OrderFrames(FrameOrder),
    /// Chooses what the right side shows.
    ShowSide(Side),
    /// Shows the other tab of the right side.
    SwitchSide,
    /// Goes to the suggestion with this index: from now on, keys answer it.
    GoToSuggestion(usize),
    /// Goes to the next suggestion.
    NextSuggestion,
    /// Goes to the suggestion before.
    PreviousSuggestion,
    /// Labels the suggestion with this index, as an object where the label says one.
    AnswerSuggestion(usize, Label),
    /// Labels the suggestion at hand as a new object of its likeliest class.
    AnswerNew,
    /// Labels the suggestion at hand with its most likely class (0), or its second (1).
    AnswerLikely(usize),
    /// Leaves the suggestion at hand out and goes to the next one.
    SkipSuggestion,
    /// Lists the skipped suggestions again.
    ListSkipped,
    /// Keys do what they always do again.
    LeaveSuggestions,
    /// Draws places to judge from these per cent of the frames, in place of those that were drawn before.
    DrawAudit(u8),
    /// Shows a place of the audit: from now on, keys judge it.
    GoToAudited(usize),
    /// Says whether the map is right at the place of the audit at hand, and goes to the next one.
    Judge(Verdict),
    /// Keys do what they always do again.
    LeaveAudit,
    /// Whether the list of suggestions must stay as it is, since the pointer is on it.
    HoldSuggestions(bool),

    /// Shows a layer.
    ChooseLayer(Layer),
    /// Shows the next layer.
    CycleLayer,
    /// How much the layer covers, 0..=1.
    SetOpacity(f32),
    /// Whether borders between classes are drawn.
    SetOutlines(bool),
    /// Whether the canvas has legends.
    SetLegend(bool),
    /// Whether what a click would win is outlined.
    SetPreview(bool),
    /// Splits the canvas between two layers, or shows one again.
    ToggleCompare,
    /// Shows a layer on the left of the split canvas.
    ChooseOtherLayer(Layer),
    /// Where the canvas is split, as a share of its width, 0..=1.
    SetSplit(f32),
    /// Radius of the brush in image pixels.
    SetBrush(u32),
    /// Makes the brush larger (positive) or smaller by so many steps.
    StepBrush(i32),
    /// Chooses what the left button does.
    ChooseTool(Tool),
    /// Switches between erasing and what the left button did before.
    ToggleTool,
    /// Has the field rendered as seen from here; no person asks for it.
    Render(Viewpoint),
    /// Zooms and pans.
    SetView(View),
    /// Fits the frame, or the scene in the 3D view.
    Fit,
    /// Switches between the frame and the 3D view.
    ToggleSpace,
    /// Changes what the 3D view shows.
    SetSpace(Space),
    /// Pauses or resumes training.
    TogglePause,
    /// Changes what the person prefers in every scene.
    Prefer(PreferenceChange),
    /// The pointer is on this pixel of the frame in view, where a press would begin to label, or on none; no person asks
    /// for it.
    Hover(Option<Pixel>),
    /// Shows the image without what lies over it, or with it again.
    HideOverlay(bool),
    /// Removes a message.
    Dismiss(u64),
    /// Removes the note about where the export went.
    DismissExport,
}

impl Command {
    /// Opens a capture.
    pub fn open_scene(source: SceneSource) -> Self {
        Self::Open(Target::Scene(source))
    }

    /// Opens something again.
    pub fn open_again(place: &RecentPlace) -> Self {
        match place {
            RecentPlace::Scene(path) => Self::open_scene(SceneSource::Folder(path.clone())),
            RecentPlace::Project(path) => Self::Open(Target::Project(path.clone())),
        }
    }

    /// Whether a held key asks for it but once: again, it would take itself back, or label what nobody has looked at.
    pub fn is_done_once(&self) -> bool {
        matches!(
            self,
            Self::ToggleTool
                | Self::ToggleSpace
                | Self::ToggleChecked
                | Self::ToggleCompare
                | Self::TogglePause
                | Self::SwitchSide
                | Self::ChooseSlot(_)
                | Self::LabelOutlined
                | Self::AnswerLikely(_)
                | Self::AnswerNew
                | Self::SkipSuggestion
                | Self::Judge(_)
        )
    }
}

/// Commands of one frame, in order.
pub type Commands = Vec<Command>;
