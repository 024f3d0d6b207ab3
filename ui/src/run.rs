//! Starting the window, with whatever can draw it.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::rc::Rc;
use std::sync::Arc;

use inplace_core::project::{autosave_path, configuration_folder, pictures_folder};
use inplace_core::scene::SceneSource;
use inplace_core::session::Session;
use inplace_model::opening::Target;
use inplace_model::preferences::Store;
use inplace_model::text::PROGRAM;

use crate::app::{App, Environment, UiOptions};

/// Width and height of a window that was never resized, in points.
const USUAL_SIZE: [f32; 2] = [1280.0, 800.0];

/// The least that the panels need, in points.
const LEAST_SIZE: [f32; 2] = [960.0, 600.0];

/// Why there is no window; a sentence each.
#[derive(Debug, thiserror::Error)]
pub enum UiError {
    /// There is no display to open a window on.
    #[error(
        "there is no display: set DISPLAY or WAYLAND_DISPLAY, or use a command that needs no window ({0})"
    )]
    NoDisplay(String),
    /// A library that the window system needs is missing.
    #[error(
        "a window needs system libraries that are missing here ({0}): install libxkbcommon-x11-0 libx11-6 \
         libx11-xcb1 libxcursor1 libxi6 mesa-vulkan-drivers"
    )]
    MissingLibrary(String),
    /// Neither wgpu nor OpenGL can draw here.
    #[error(
        "nothing here can draw a window ({0}): install mesa-vulkan-drivers, or libegl1 and libgl1-mesa-dri"
    )]
    NoRenderer(String),
}

/// Opens the window and returns when it is closed.
///
/// # Errors
/// Why there is no window, and what to install or do.
pub fn run(options: UiOptions) -> Result<(), UiError> {
    let store = Store::open(configuration_folder().join("preferences.json"));
    let window = store.preferences().window;
    // Whoever has opened scenes before chooses among them.
    let is_new = store.preferences().recents.is_empty();
    let demo = is_new.then_some(Target::Scene(SceneSource::Demo));
    let options = UiOptions {
        open: options.open.or(demo),
        ..options
    };
    // Whichever renderer starts takes it.
    let store = Rc::new(RefCell::new(Some(store)));
    let mut reasons = Vec::new();
    for drawing in [Drawing::Gpu, Drawing::OpenGl, Drawing::AnyWgpu] {
        match start(&options, window, &store, drawing) {
            Err(Failure::Unfit(reason)) => reasons.push(reason),
            Err(Failure::Other(error)) => return Err(error),
            Ok(()) => return Ok(()),
        }
    }
    Err(UiError::NoRenderer(reasons.join("; ")))
}

/// What may draw the window, the best first. Without a GPU that is OpenGL: egui's shader for wgpu does several times the
/// work of that for OpenGL at every pixel, which a GPU does not notice and a processor does.
#[derive(Clone, Copy, PartialEq)]
enum Drawing {
    /// wgpu on a GPU.
    Gpu,
    /// OpenGL, which Mesa also draws in software.
    OpenGl,
    /// wgpu on whatever there is.
    AnyWgpu,
}

/// The program's icon; a broken one would be egui's.
fn icon() -> egui::IconData {
    eframe::icon_data::from_png_bytes(include_bytes!("../assets/icon.png")).unwrap_or_default()
}

/// Why a renderer did not start.
enum Failure {
    /// Another way of drawing may do.
    Unfit(String),
    Other(UiError),
}

fn start(
    options: &UiOptions,
    window: Option<[f32; 2]>,
    store: &Rc<RefCell<Option<Store>>>,
    drawing: Drawing,
) -> Result<(), Failure> {
    let native = eframe::NativeOptions {
        renderer: match drawing {
            Drawing::Gpu | Drawing::AnyWgpu => eframe::Renderer::Wgpu,
            Drawing::OpenGl => eframe::Renderer::Glow,
        },
        viewport: egui::ViewportBuilder::default()
            .with_app_id("inplace")
            .with_title(PROGRAM)
            .with_icon(icon())
            .with_inner_size(window.unwrap_or(USUAL_SIZE))
            .with_min_inner_size(LEAST_SIZE)
            .with_drag_and_drop(true),
        ..eframe::NativeOptions::default()
    };
    let (options, held) = (options.clone(), Rc::clone(store));
    let create: eframe::AppCreator<'static> = Box::new(move |creation| {
        let info = creation
            .wgpu_render_state
            .as_ref()
            .map(|render| render.adapter.get_info());
        if let Some(info) = &info
            && drawing == Drawing::Gpu
            && info.device_type == wgpu::DeviceType::Cpu
        {
            return Err(NoGpu(info.name.clone()).into());
        }
        let Some(preferences) = held.borrow_mut().take() else {
            return Err("the preferences belong to another window already".into());
        };
        if let Some(render) = &creation.wgpu_render_state {
            // Shaders take a while to compile: here, before there is a frame that would wait for them.
            crate::canvas::make_ready(render);
            crate::view3d::make_ready(render);
        }
        let environment = Environment {
            sessions: Box::new(Session::beside_window),
            autosave: Arc::new(autosave_path),
            preferences,
            pictures: pictures_folder(),
            renderer: info.map_or_else(
                || "OpenGL".to_owned(),
                |info| format!("{} ({})", info.name, info.backend),
            ),
            target: creation
                .wgpu_render_state
                .as_ref()
                .map(|render| render.target_format),
        };
        Ok(Box::new(App::new(&creation.egui_ctx, options, environment)))
    });
    // winit panics where a library is missing.
    let quiet = QuietPanics::new();
    let result = catch_unwind(AssertUnwindSafe(|| eframe::run_native("inplace", native, create)));
    drop(quiet);
    match result {
        Ok(Ok(())) => Ok(()),
        Ok(Err(error)) => Err(classify(error)),
        Err(panic) => {
            let reason = panic_message(panic.as_ref());
            if is_missing_library(&reason) {
                Err(Failure::Other(UiError::MissingLibrary(reason)))
            } else if store.borrow().is_some() {
                // Before there was a window, so a driver did what it may not. winit cannot start again after this.
                Err(Failure::Other(UiError::NoRenderer(reason)))
            } else {
                std::panic::resume_unwind(panic)
            }
        }
    }
}

fn classify(error: eframe::Error) -> Failure {
    match error {
        eframe::Error::WinitEventLoop(error) => Failure::Other(classify_display(error.to_string())),
        eframe::Error::Winit(error) => Failure::Other(classify_display(error.to_string())),
        eframe::Error::AppCreation(error) if !error.is::<NoGpu>() => {
            Failure::Other(UiError::NoRenderer(error.to_string()))
        }
        error => Failure::Unfit(error.to_string()),
    }
}

/// wgpu would draw in software.
#[derive(Debug, thiserror::Error)]
#[error("{0} is no GPU")]
struct NoGpu(String);

/// winit reports a library of X11 that is missing like a display that is.
fn classify_display(reason: String) -> UiError {
    let reason = without_source_location(&reason);
    if is_missing_library(&reason) {
        UiError::MissingLibrary(reason)
    } else {
        UiError::NoDisplay(reason)
    }
}

fn is_missing_library(reason: &str) -> bool {
    let is_library = |word: &str| {
        let name = word.trim_end_matches(|last: char| !last.is_alphanumeric());
        name.ends_with(".so") || name.contains(".so.")
    };
    let told = ["could not be loaded", "shared librar"];
    told.iter().any(|words| reason.contains(*words)) || reason.split_whitespace().any(is_library)
}

/// winit starts its messages with the place in its own source.
fn without_source_location(reason: &str) -> String {
    let after = reason.split_once(".rs:").map(|(_, rest)| rest);
    let message = after
        .and_then(|rest| rest.split_once(": "))
        .map(|(_, message)| message);
    message.unwrap_or(reason).trim_end_matches('.').to_owned()
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("unknown reason").trim_end_matches('.').to_owned()
}

/// While this lives, the panic of a missing library prints nothing: it becomes an error with a sentence.
struct QuietPanics {
    /// What is done at a panic otherwise, such as logging it.
    hook: Arc<dyn Fn(&PanicHookInfo<'_>) + Send + Sync>,
}

impl QuietPanics {
    fn new() -> Self {
        let hook: Arc<dyn Fn(&PanicHookInfo<'_>) + Send + Sync> = std::panic::take_hook().into();
        let usual = Arc::clone(&hook);
        std::panic::set_hook(Box::new(move |panic| {
            let message = panic.payload().downcast_ref::<String>().map(String::as_str);
            let message = message.or_else(|| panic.payload().downcast_ref::<&str>().copied());
            if !message.is_some_and(is_missing_library) {
                usual(panic);
            }
        }));
        Self { hook }
    }
}

impl Drop for QuietPanics {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let hook = Arc::clone(&self.hook);
            std::panic::set_hook(Box::new(move |panic| hook(panic)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_library_is_told_from_a_missing_display() {
        let library = "Library libxkbcommon-x11.so could not be loaded.".to_owned();
        assert!(matches!(classify_display(library), UiError::MissingLibrary(_)));
        assert!(is_missing_library("libX11.so.6: cannot open it"));
        assert!(!is_missing_library("/scans/living.sofa/1.png: no such file"));
        let display = "os error at /a/mod.rs:765: neither WAYLAND_DISPLAY nor DISPLAY is set.".to_owned();
        let UiError::NoDisplay(reason) = classify_display(display) else {
            panic!("not a missing display")
        };
        assert_eq!(reason, "neither WAYLAND_DISPLAY nor DISPLAY is set");
    }
}
