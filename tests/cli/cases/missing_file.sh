texel bake missing.obj -o out.texel
