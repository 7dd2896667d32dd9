# Colour by position, of noise; the pack remembers it.
texel bake "$DATA/cube.obj" --solid-texture marble --solid-size 0.3 -r 12 --want color,density -o stone.texel --progress never
texel check stone.texel
texel bake --recipe stone.texel "$DATA/cube.obj" -o again.texel --progress never
cmp stone.texel/volume.vdb again.texel/volume.vdb
