//! What a picture of the rig needs beyond its shape: normals, texture coordinates, colours.

use serde_json::Value;

use super::file::File;
use super::uri::{self, Target};
use super::{Mesh, Skin};
use crate::error::{Error, Result};

/// Opacity below which a pixel is left out where the material says nothing else (glTF 2.0 §3.9.4).
const CUTOFF: f64 = 0.5;

/// A mesh of the scene and what it looks like.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// The mesh, as in [`Model::meshes`](super::Model::meshes).
    pub mesh: Mesh,
    /// Unit normals in mesh space, one a vertex; empty when the file has none.
    pub normals: Vec<[f64; 3]>,
    /// Texture coordinates, one a vertex; empty when the file has none.
    pub texture_coordinates: Vec<[f64; 2]>,
    /// Its material.
    pub look: Look,
}

/// The part of a material that a plain picture shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Red, green, blue (linear light) and opacity, 0 to 1; multiplies the texture.
    pub base_colour: [f64; 4],
    /// Index into the file's images, `None` without a texture.
    pub image: Option<usize>,
    /// Pixels of less opacity are not drawn; `None` for an opaque material.
    pub cutoff: Option<f64>,
}

impl Look {
    /// White, without a texture: the default material of glTF.
    pub const PLAIN: Self = Self { base_colour: [1.0; 4], image: None, cutoff: None };
}

impl File {
    /// The triangle meshes of the scene with their looks, and the skins they are bound by.
    ///
    /// # Errors
    /// As [`File::model`].
    pub fn surfaces(&self) -> Result<(Vec<Surface>, Vec<Skin>)> {
        let (skins, primitives) = self.drawn_primitives()?;
        let surfaces = primitives
            .into_iter()
            .map(|(mesh, primitive)| self.surface(mesh, primitive))
            .collect::<Result<_>>()?;
        Ok((surfaces, skins))
    }

    fn surface(&self, mesh: Mesh, primitive: &Value) -> Result<Surface> {
        let (look, set) = match self.index(primitive, "material", "primitive")? {
            Some(material) => self.look(material)?,
            None => (Look::PLAIN, 0),
        };
        let vertices = mesh.positions.len();
        Ok(Surface {
            normals: self.of_every_vertex(primitive, "NORMAL", vertices)?,
            texture_coordinates: self.of_every_vertex(
                primitive,
                &format!("TEXCOORD_{set}"),
                vertices,
            )?,
            mesh,
            look,
        })
    }

    /// An attribute of a primitive; empty when it has none.
    fn of_every_vertex<const N: usize>(
        &self,
        primitive: &Value,
        name: &str,
        vertices: usize,
    ) -> Result<Vec<[f64; N]>> {
        let Some(attributes) = primitive.get("attributes") else { return Ok(Vec::new()) };
        let Some(accessor) = self.index(attributes, name, "primitive")? else {
            return Ok(Vec::new());
        };
        let values = self.accessor::<N>(accessor)?;
        if values.len() == vertices {
            Ok(values)
        } else {
            let reason = format!("{name} has {} elements for {vertices} vertices", values.len());
            Err(self.fault(format!("accessor {accessor}"), reason))
        }
    }

    /// A material, and the set of texture coordinates its texture is laid on by.
    fn look(&self, index: usize) -> Result<(Look, usize)> {
        let place = format!("material {index}");
        let material = self
            .list("materials")?
            .get(index)
            .ok_or_else(|| self.fault(&place, "it does not exist"))?;
        let mut look = Look::PLAIN;
        if matches!(material.get("alphaMode").and_then(Value::as_str), Some("MASK" | "BLEND")) {
            look.cutoff = material.get("alphaCutoff").and_then(Value::as_f64).or(Some(CUTOFF));
        }
        let Some(metallic) = material.get("pbrMetallicRoughness") else { return Ok((look, 0)) };
        if let Some(colour) = self.numbers::<4>(metallic, "baseColorFactor", &place)? {
            look.base_colour = colour;
        }
        let Some(texture) = metallic.get("baseColorTexture") else { return Ok((look, 0)) };
        let set = self.index(texture, "texCoord", &place)?.unwrap_or(0);
        let texture = self.required(texture, "index", &place)?;
        if let Some(texture) = self.list("textures")?.get(texture) {
            look.image = self.index(texture, "source", &place)?;
        }
        Ok((look, set))
    }

    /// The bytes of an image file: from a buffer, a `data:` URI, or a file beside the rig.
    ///
    /// # Errors
    /// [`Error::RigBroken`] when there is no such image, [`Error::Io`] when its file cannot be read.
    pub fn image(&self, index: usize) -> Result<Vec<u8>> {
        let place = format!("image {index}");
        let image = self
            .list("images")?
            .get(index)
            .ok_or_else(|| self.fault(&place, "it does not exist"))?;
        if let Some(view) = self.index(image, "bufferView", &place)? {
            return Ok(self.view(view, &place)?.0.to_vec());
        }
        let Some(text) = image.get("uri").and_then(Value::as_str) else {
            return Err(self.fault(place, "it has neither a bufferView nor a \"uri\""));
        };
        match uri::resolve(text).map_err(|reason| self.fault(place, reason))? {
            Target::Data(data) => Ok(data),
            Target::Relative(relative) => {
                let file = self.path().parent().unwrap_or(std::path::Path::new("")).join(relative);
                std::fs::read(&file).map_err(Error::io(&file, "read"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// One triangle with a material; `mesh` is the rest of the document.
    fn file(material: &str, texture_coordinates: usize) -> File {
        let mut data: Vec<u8> = Vec::new();
        let floats =
            [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
        floats.iter().for_each(|f| data.extend(f.to_le_bytes()));
        let hex: String = data.iter().map(|b| format!("%{b:02x}")).collect();
        let text = format!(
            r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "TEXCOORD_1": 1}}, "material": 0}}]}}],
            "materials": [{material}], "textures": [{{"source": 0}}],
            "images": [{{"uri": "data:image/png,abc"}}],
            "accessors": [
              {{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}},
              {{"bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": {texture_coordinates}, "type": "VEC2"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 60}}],
            "buffers": [{{"byteLength": 60, "uri": "data:application/octet-stream,{hex}"}}]}}"#
        );
        File::from_bytes(Path::new("rig.gltf"), text.into_bytes()).unwrap()
    }

    #[test]
    fn a_material_gives_colour_texture_and_cutoff() {
        let material = r#"{"alphaMode": "MASK", "alphaCutoff": 0.25, "pbrMetallicRoughness":
            {"baseColorFactor": [0.5, 0.25, 0, 1], "baseColorTexture": {"index": 0, "texCoord": 1}}}"#;
        let file = file(material, 3);
        let (surfaces, skins) = file.surfaces().unwrap();
        assert!(skins.is_empty() && surfaces.len() == 1);
        let look = Look { base_colour: [0.5, 0.25, 0.0, 1.0], image: Some(0), cutoff: Some(0.25) };
        assert_eq!(surfaces[0].look, look);
        assert_eq!(surfaces[0].texture_coordinates, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        assert!(surfaces[0].normals.is_empty());
        assert_eq!(file.image(0).unwrap(), b"abc");
        assert!(file.image(1).is_err());
    }

    #[test]
    fn attributes_of_another_length_are_refused() {
        let material =
            r#"{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1}}}"#;
        let error = file(material, 2).surfaces().unwrap_err();
        assert!(matches!(error, Error::RigBroken { .. }), "{error}");
        let plain = file("{}", 2).surfaces().unwrap().0;
        assert_eq!(plain[0].look, Look::PLAIN);
    }
}
