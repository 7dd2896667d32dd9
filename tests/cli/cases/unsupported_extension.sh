touch scene.blend; texel bake scene.blend -o out.texel
