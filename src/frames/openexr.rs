//! OpenEXR files without plain `R`, `G`, `B` channels: the single-channel mattes of roto tools and
//! the prefixed layers (`ViewLayer.Combined.R`) of renderers. Files with plain channels are read
//! by the image library itself.

use std::io::Cursor;

use ::image::{DynamicImage, Rgba32FImage};
use exr::prelude::{
    AnyChannels, FlatImage, FlatSamples, Layer, ReadChannels as _, ReadLayers as _, Text, read,
};

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Which channels of a file become red, green, blue and alpha, by their place in its list.
#[derive(Debug, PartialEq, Eq)]
struct Roles {
    rgb: [usize; 3],
    alpha: Option<usize>,
}

/// Finds the picture among the channel names, in this order of preference: the first layer with
/// `R`, `G` and `B`; a luminance `Y`; alpha `A` alone, which then also is the grey value; the one
/// and only channel under any name.
fn roles(names: &[String]) -> Option<Roles> {
    let place = |name: String| names.iter().position(|n| *n == name);
    let alpha = |prefix: &str| place(format!("{prefix}A"));
    for prefix in names.iter().filter_map(|n| n.strip_suffix('R')) {
        if let (Some(r), Some(g), Some(b)) =
            (place(format!("{prefix}R")), place(format!("{prefix}G")), place(format!("{prefix}B")))
        {
            return Some(Roles { rgb: [r, g, b], alpha: alpha(prefix) });
        }
    }
    let is = |n: &str, letter| n == letter || n.ends_with(&format!(".{letter}"));
    if let Some(y) = names.iter().position(|n| is(n, "Y")) {
        let prefix = names[y].trim_end_matches('Y');
        return Some(Roles { rgb: [y; 3], alpha: alpha(prefix) });
    }
    if let Some(a) = names.iter().position(|n| is(n, "A")) {
        return Some(Roles { rgb: [a; 3], alpha: Some(a) });
    }
    (names.len() == 1).then_some(Roles { rgb: [0; 3], alpha: None })
}

/// Largest width and height any part of the file declares: its display window or its data window.
pub(super) fn largest_size(bytes: &[u8]) -> Result<(usize, usize), Failure> {
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false)?;
    let mut size = (0, 0);
    for header in &meta.headers {
        let display = header.shared_attributes.display_window.size;
        size.0 = size.0.max(display.width()).max(header.layer_size.width());
        size.1 = size.1.max(display.height()).max(header.layer_size.height());
    }
    Ok(size)
}

/// Decodes the first flat layer to linear RGBA; pixels of the display window outside the data
/// window are zero, as OpenEXR says.
pub(super) fn decode(bytes: &[u8]) -> Result<DynamicImage, Failure> {
    let image: FlatImage = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    let window = image.attributes.display_window;
    let (layer, roles) = image
        .layer_data
        .iter()
        .find_map(|layer| roles(&channel_names(layer)).map(|roles| (layer, roles)))
        .ok_or("no layer has channels named R, G and B, or Y, or A")?;
    let channel = |at: usize| &layer.channel_data.list[at].sample_data;
    let offset = layer.attributes.layer_position - window.position;
    let (across, down) = (layer.size.width(), layer.size.height());
    let mut out = Rgba32FImage::new(
        u32::try_from(window.size.width())?,
        u32::try_from(window.size.height())?,
    );
    for (x, y, pixel) in out.enumerate_pixels_mut() {
        let column = i64::from(x) - i64::from(offset.x());
        let row = i64::from(y) - i64::from(offset.y());
        let (Ok(column), Ok(row)) = (usize::try_from(column), usize::try_from(row)) else {
            continue;
        };
        if column >= across || row >= down {
            continue;
        }
        let at = row * across + column;
        let [r, g, b] = roles.rgb.map(|c| sample(channel(c), at));
        pixel.0 = [r, g, b, roles.alpha.map_or(1.0, |c| sample(channel(c), at))];
    }
    Ok(out.into())
}

fn channel_names(layer: &Layer<AnyChannels<FlatSamples>>) -> Vec<String> {
    layer.channel_data.list.iter().map(|c| Text::to_string(&c.name)).collect()
}

fn sample(samples: &FlatSamples, at: usize) -> f32 {
    if at < samples.len() { samples.value_by_flat_index(at).to_f32() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use exr::prelude::{AnyChannel, Encoding, Image, LayerAttributes, SmallVec, WritableImage};

    use super::*;

    fn file(channels: &[(&str, [f32; 2])]) -> Vec<u8> {
        let list: SmallVec<[_; 4]> = channels
            .iter()
            .map(|(name, values)| AnyChannel::new(*name, FlatSamples::F32(values.to_vec())))
            .collect();
        let layer = Layer::new(
            (2, 1),
            LayerAttributes::named("first"),
            Encoding::UNCOMPRESSED,
            AnyChannels::sort(list),
        );
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    fn pixels(channels: &[(&str, [f32; 2])]) -> Vec<[f32; 4]> {
        let image = decode(&file(channels)).unwrap().into_rgba32f();
        image.pixels().map(|p| p.0).collect()
    }

    #[test]
    fn single_channels_are_grey_and_alpha_is_both() {
        assert_eq!(pixels(&[("Y", [0.25, 1.0])]), [[0.25, 0.25, 0.25, 1.0], [1.0; 4]]);
        assert_eq!(pixels(&[("A", [0.25, 1.0])]), [[0.25; 4], [1.0; 4]]);
        assert_eq!(pixels(&[("matte", [0.5, 0.0])]), [[0.5, 0.5, 0.5, 1.0], [0.0, 0.0, 0.0, 1.0]]);
    }

    #[test]
    fn the_first_layer_with_colours_is_taken() {
        let got = pixels(&[
            ("Depth.Z", [9.0, 9.0]),
            ("View.Combined.R", [0.1, 0.2]),
            ("View.Combined.G", [0.3, 0.4]),
            ("View.Combined.B", [0.5, 0.6]),
            ("View.Combined.A", [0.7, 0.8]),
        ]);
        assert_eq!(got, [[0.1, 0.3, 0.5, 0.7], [0.2, 0.4, 0.6, 0.8]]);
    }

    #[test]
    fn channels_that_are_no_picture_are_refused() {
        assert!(decode(&file(&[("N.X", [0.0; 2]), ("N.Z", [0.0; 2])])).is_err());
    }
}
