# A picture with its colour, baked twice over: with other threads, and again from the pack, which finds both pictures.
texel bake --recipe "$ROOT/samples/terrain/recipe.json" "$ROOT/samples/terrain/crater.png" -o a.texel -r 24 --no-data 1057 --threads 1 &&
  texel check a.texel &&
  texel bake --recipe a.texel -o b.texel --threads 4 && cmp a.texel/volume.vdb b.texel/volume.vdb && cmp a.texel/preview.png b.texel/preview.png &&
  texel bake --recipe a.texel -o c.texel --want density,color && texel view a.texel --truth -o truth.png --size 64x48
