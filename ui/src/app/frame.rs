//! A frame of the window, from its input to its picture.

use std::time::Instant;

use egui::{Event, Key};
use inplace_model::model::Stage;
use inplace_model::project_session::ProjectSession;
use inplace_model::{Command, Commands, Input};

use super::App;
use crate::stats::Stats;
use crate::{keys, panels, theme};

impl eframe::App for App {
    fn logic(&mut self, _ctx: &egui::Context, _frame: &mut eframe::Frame) {
        let now = Instant::now();
        if let Some(stats) = &mut self.stats {
            let active = self.ctx.input(|input| {
                let pointer = &input.pointer;
                pointer.delta() != egui::Vec2::ZERO || pointer.any_down()
            });
            stats.frame_begins(now, active);
        }
        self.drain();
        let window = self.window_size();
        self.update(Input::FrameBegins { now, window });
        if self.ctx.input(|input| input.viewport().close_requested()) {
            self.update(Command::CloseWindow);
        }
        self.prepare();
        self.set_title();
        let at_start = matches!(self.model.stage, Stage::Start);
        if at_start && !self.at_start {
            self.look_at_recents();
        }
        self.at_start = at_start;
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let mut commands = Commands::default();
        let ctx = self.ctx.clone();
        self.take_dropped_files(&mut commands);
        let asked = keys::Asked::of(self.model.workspace());
        if self.model.dialog.is_none() {
            self.canvas.take_keys(&ctx, &self.model, &mut commands);
            keys::dispatch(&ctx, asked, &mut commands);
        }
        // Keys come before the clicks of the same frame, which they may be about.
        self.update_all(std::mem::take(&mut commands));
        // What an open dialog, a menu, a text field or a suggestion does with Escape comes before the messages.
        let free = asked == keys::Asked::Nothing && !keys::are_taken(&ctx);
        let escape = self.model.dialog.is_none() && free;
        self.panels.show(ui, &self.model, &mut self.canvas, &mut commands);
        let edited = self
            .dialogs
            .show(&ctx, &self.model, self.canvas.rect, &mut commands);
        let open = matches!(self.model.stage, Stage::Open(_));
        let area = if open {
            self.canvas.rect
        } else {
            ctx.content_rect()
        };
        panels::work(&ctx, &self.model, area, &mut commands);
        panels::drop_area(&ctx);
        panels::messages(&ctx, &self.model.messages, area, escape, &mut commands);
        // What was typed is known to whatever was pressed after it.
        self.update_all(edited.into_iter().chain(commands));
        // What a command asks for is under way before the next frame.
        self.prepare();
        self.store.keep(&self.model.preferences);
        if let Some(trace) = &mut self.trace {
            trace.observe(&self.model, ctx.text_edit_focused());
        }
        if let (Some(stats), Some(workspace)) = (&mut self.stats, self.model.workspace()) {
            stats.in_view(workspace.frame_index);
            if let Some(preview) = &workspace.hover.shown {
                stats.outlined(&preview.stroke);
            }
        }
        if self.stats.as_mut().is_some_and(Stats::frame_made) {
            ctx.request_repaint();
        }
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        theme::of(visuals).panel.to_normalized_gamma_f32()
    }

    /// Over the canvas the Tab key hides the overlay; elsewhere it moves the focus as usual.
    fn raw_input_hook(&mut self, ctx: &egui::Context, input: &mut egui::RawInput) {
        let over_canvas = self.model.dialog.is_none()
            && self.model.workspace().is_some()
            && !keys::are_taken(ctx)
            && ctx
                .pointer_hover_pos()
                .is_some_and(|position| self.canvas.rect.contains(position));
        let mut hidden = self.model.overlay_hidden;
        input.events.retain(|event| match event {
            Event::Key {
                key: Key::Tab,
                pressed,
                ..
            } if over_canvas || (hidden && !pressed) => {
                hidden = *pressed;
                false
            }
            Event::WindowFocused(false) => {
                hidden = false;
                true
            }
            _ => true,
        });
        if hidden != self.model.overlay_hidden {
            self.update(Command::HideOverlay(hidden));
        }
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        self.end();
        if let Some(stats) = &self.stats {
            eprintln!("{}", stats.json());
        }
    }
}

impl App {
    /// Carries out what was asked for, and has the window drawn again where anything was.
    fn update_all(&mut self, commands: impl IntoIterator<Item = Command>) {
        for command in commands {
            self.update(command);
            self.ctx.request_repaint();
        }
    }

    /// Has what the canvas shows made ready.
    fn prepare(&mut self) {
        let mut commands = Commands::default();
        self.canvas.prepare(&self.ctx, &self.model, &mut commands);
        for command in commands {
            self.update(command);
        }
    }

    /// Width and height of the window in points of the screen, whatever the scale; `None` while it fills the screen.
    fn window_size(&self) -> Option<[f32; 2]> {
        let scale = self.ctx.zoom_factor();
        self.ctx.input(|input| {
            let viewport = input.viewport();
            let whole = viewport.maximized == Some(true) || viewport.fullscreen == Some(true);
            let inner = viewport.inner_rect.filter(|_| !whole)?;
            let size = inner.size() * scale;
            Some([size.x.round(), size.y.round()])
        })
    }

    fn set_title(&mut self) {
        let saved = self.model.project.as_ref().map(ProjectSession::saved_state);
        let title = panels::window_title(self.model.document_name().as_deref(), saved);
        if title != self.title {
            self.title.clone_from(&title);
            self.ctx.send_viewport_cmd(egui::ViewportCommand::Title(title));
        }
    }

    fn take_dropped_files(&self, commands: &mut Commands) {
        let dropped = self.ctx.input(|input| {
            let first = input.raw.dropped_files.first();
            first.map(|file| file.path().to_path_buf())
        });
        if let Some(path) = dropped {
            commands.push(Command::Dropped(path));
        }
    }
}
