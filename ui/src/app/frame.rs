//! A frame of the window, from its input to its picture.

use std::time::Instant;

use egui::{Event, Key};

use super::App;
use crate::action::Actions;
use crate::english;
use crate::keeper::Keeper;
use crate::state::Stage;

impl eframe::App for App {
    fn logic(&mut self, _ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.frame_started = Some(Instant::now());
        if let Some(stats) = &mut self.state.stats {
            stats.frame_begins();
        }
        self.drain_jobs();
        self.drain_session();
        self.drain_keeper();
        self.look_over();
        self.hold_open_while_exporting();
        self.prepare_layers();
        let ctx = self.ctx.clone();
        self.state.toasts.expire(&ctx);
        self.set_title();
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let mut actions = Actions::default();
        let ctx = self.ctx.clone();
        if ctx.current_pass_index() == 0 {
            self.take_dropped_files(&mut actions);
            if self.state.dialog.is_none() {
                let workspace = self.state.workspace();
                let guided = workspace.is_some_and(|workspace| workspace.guidance().is_active());
                self.canvas.take_keys(&ctx, &self.state, &mut actions);
                crate::keys::dispatch(&ctx, guided, &mut actions);
            }
        }
        // What an open dialog or a text field does with Escape comes before the messages.
        let escape = self.state.dialog.is_none() && !ctx.text_edit_focused();
        self.panels.show(ui, &self.state, &mut self.canvas, &mut actions);
        let mut dialog = self.state.dialog.take();
        if let Some(dialog) = &mut dialog {
            dialog.show(&ctx, &self.state, &mut actions);
        }
        self.state.dialog = dialog;
        let area = match self.state.stage {
            Stage::Open(_) => self.canvas.rect(),
            Stage::Start | Stage::Opening(_) => ctx.content_rect(),
        };
        crate::panels::work(&ctx, &self.state, area, &mut actions);
        crate::panels::drop_area(&ctx);
        self.state.toasts.show(&ctx, area, escape, &mut actions);
        for action in actions.take() {
            self.apply(action);
            ctx.request_repaint();
        }
        // What an action asks for is under way before the next frame.
        self.prepare_layers();
        self.keep_preferences();
        if let Some(trace) = &mut self.trace {
            trace.observe(&self.state, ctx.text_edit_focused());
        }
        if let (Some(stats), Some(started)) = (&mut self.state.stats, self.frame_started) {
            stats.frame_done(started.elapsed(), frame.info().cpu_usage);
        }
    }

    /// Over the canvas the Tab key hides the overlay; elsewhere it moves the focus as usual.
    fn raw_input_hook(&mut self, ctx: &egui::Context, input: &mut egui::RawInput) {
        let over_canvas = self.state.dialog.is_none()
            && self.state.workspace().is_some()
            && !ctx.text_edit_focused()
            && ctx
                .pointer_hover_pos()
                .is_some_and(|position| self.canvas.rect().contains(position));
        let mut hidden = self.state.overlay_hidden;
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
        self.state.overlay_hidden = hidden;
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        self.end();
        if let Some(stats) = &self.state.stats {
            eprintln!("{}", stats.json());
        }
    }
}

impl App {
    fn set_title(&mut self) {
        let saved = self.state.keeper.as_ref().map(Keeper::saved_state);
        let title = english::saving::title(self.state.document_name().as_deref(), saved);
        if title != self.title {
            self.title.clone_from(&title);
            self.ctx.send_viewport_cmd(egui::ViewportCommand::Title(title));
        }
    }

    fn take_dropped_files(&self, actions: &mut Actions) {
        let dropped = self.ctx.input(|input| {
            let first = input.raw.dropped_files.first();
            first.map(|file| file.path().to_path_buf())
        });
        if let Some(path) = dropped {
            actions.push(crate::action::Action::OpenPath(path));
        }
    }
}
