texel bake "$DATA/no_faces.obj" -o out.texel
