//! Letters that the program's own typeface lacks: from a font of this computer, read when the first of them is shown.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

use eframe::egui::epaint::text::{FallbackRequest, FontInsert};
use eframe::egui::{Context, FontData};
use touch2touch_pipeline::io::fonts;

/// Lets `ctx` draw East Asian letters; those that no font has are received.
pub(crate) fn install(ctx: &Context) -> Receiver<char> {
    let (sender, lacking) = channel();
    ctx.add_font_provider(Arc::new(move |wanted: &FallbackRequest<'_>| {
        let letter = wanted.cluster.chars().next().filter(|letter| fonts::is_east_asian(*letter))?;
        let Some(font) = fonts::covering(&[letter]) else {
            // The window may be gone by now: then nobody is told.
            sender.send(letter).ok();
            return None;
        };
        Some(FontInsert::new(font.name, FontData::from_static(font.bytes), Vec::new()))
    }));
    lacking
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{FontId, RawInput};

    #[test]
    fn east_asian_letters_have_a_font_or_are_said_to_lack_one() {
        let ctx = Context::default();
        let lacking = install(&ctx);
        let mut said = Vec::new();
        for letter in ['\u{6f22}', '\u{304b}', '\u{d55c}', 'a'] {
            let mut output = ctx.run_ui(RawInput::default(), |ui| drop(ui.label(letter.to_string())));
            output.textures_delta.clear();
            let known = ctx.fonts_mut(|fonts| fonts.has_glyph(&FontId::default(), letter));
            let there = letter == 'a' || fonts::covering(&[letter]).is_some();
            said.extend(lacking.try_iter());
            assert_eq!((known, said.contains(&letter)), (there, !there), "{letter:?}");
        }
    }
}
