//! The theme of the window: dark and muted, so that the picture is its brightest part.

use eframe::egui::{
    self, Color32, Context, CornerRadius, FontFamily, FontId, RichText, Stroke, TextStyle, Theme,
    Visuals, vec2,
};

/// Background of the picture.
pub(super) const BACKDROP: Color32 = Color32::from_rgb(14, 15, 17);
/// Background of panels.
pub(super) const PANEL: Color32 = Color32::from_rgb(24, 26, 30);
/// Background of dialogs and labels over the picture.
pub(super) const OVERLAY: Color32 = Color32::from_rgb(20, 21, 25);
/// Separators and borders.
pub(super) const LINE: Color32 = Color32::from_rgb(44, 47, 54);
/// Normal text.
pub(super) const TEXT: Color32 = Color32::from_rgb(210, 214, 222);
/// Secondary text.
pub(super) const WEAK: Color32 = Color32::from_rgb(139, 145, 157);
/// Selected or changed items.
pub(super) const ACCENT: Color32 = Color32::from_rgb(122, 170, 245);
/// Messages of errors.
pub(super) const ERROR: Color32 = Color32::from_rgb(242, 110, 112);
/// Messages of warnings.
pub(super) const WARNING: Color32 = Color32::from_rgb(230, 180, 92);
/// Help texts and notes.
pub(super) const HELP: Color32 = Color32::from_rgb(112, 190, 160);

/// Returns a monospaced font of this size.
pub(super) fn mono(size: f32) -> FontId {
    FontId::new(size, FontFamily::Monospace)
}

/// Formats the heading of a group.
pub(super) fn heading(text: &str) -> RichText {
    RichText::new(text).size(11.5).color(WEAK)
}

/// Applies the theme to the window.
pub(super) fn apply(ctx: &Context) {
    ctx.set_theme(Theme::Dark);
    ctx.all_styles_mut(|style| {
        let size = |size| FontId::new(size, FontFamily::Proportional);
        style.text_styles = [
            (TextStyle::Heading, size(16.0)),
            (TextStyle::Body, size(13.5)),
            (TextStyle::Button, size(13.5)),
            (TextStyle::Small, size(11.5)),
            (TextStyle::Monospace, mono(12.5)),
        ]
        .into();
        style.spacing.item_spacing = vec2(8.0, 6.0);
        style.spacing.button_padding = vec2(8.0, 3.0);
        style.spacing.interact_size.y = 22.0;
        style.spacing.slider_rail_height = 4.0;
        style.spacing.tooltip_width = 340.0;
        style.spacing.scroll = egui::style::ScrollStyle::thin();
        style.interaction.tooltip_delay = 0.35;
        // Labels are not selectable; reports enable selection themselves.
        style.interaction.selectable_labels = false;
        style.animation_time = 0.08;
        style.visuals = visuals();
    });
}

fn visuals() -> Visuals {
    let mut v = Visuals::dark();
    let round = CornerRadius::same(4);
    v.panel_fill = PANEL;
    v.window_fill = OVERLAY;
    v.window_stroke = Stroke::new(1.0, LINE);
    v.window_corner_radius = CornerRadius::same(6);
    v.menu_corner_radius = CornerRadius::same(6);
    v.extreme_bg_color = Color32::from_rgb(15, 16, 19);
    v.faint_bg_color = Color32::from_rgb(29, 31, 36);
    v.code_bg_color = Color32::from_rgb(15, 16, 19);
    v.hyperlink_color = ACCENT;
    v.error_fg_color = ERROR;
    v.warn_fg_color = WARNING;
    v.weak_text_color = Some(WEAK);
    v.selection.bg_fill = Color32::from_rgb(46, 74, 120);
    v.selection.stroke = Stroke::new(1.0, Color32::from_rgb(222, 232, 250));
    v.slider_trailing_fill = true;
    v.handle_shape = egui::style::HandleShape::Circle;
    // A blinking cursor would draw frames at rest.
    v.text_cursor.blink = false;
    let states = [
        (&mut v.widgets.noninteractive, PANEL, LINE, TEXT),
        (
            &mut v.widgets.inactive,
            grey(38),
            Color32::TRANSPARENT,
            TEXT,
        ),
        (&mut v.widgets.hovered, grey(50), grey(72), Color32::WHITE),
        (&mut v.widgets.active, grey(60), ACCENT, Color32::WHITE),
        (&mut v.widgets.open, grey(44), grey(72), Color32::WHITE),
    ];
    for (widget, fill, line, text) in states {
        widget.bg_fill = fill;
        widget.weak_bg_fill = fill;
        widget.bg_stroke = Stroke::new(1.0, line);
        widget.fg_stroke = Stroke::new(1.0, text);
        widget.corner_radius = round;
        widget.expansion = 0.0;
    }
    v
}

/// Returns a slightly blue grey.
fn grey(v: u8) -> Color32 {
    Color32::from_rgb(v, v + 2, v + 8)
}
