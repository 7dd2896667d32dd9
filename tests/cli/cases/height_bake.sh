# A picture with its colour, baked twice over: with other threads, and again from the pack, which finds both pictures.
cp "$ROOT"/samples/terrain/*.png "$ROOT"/samples/terrain/recipe.json . &&
  texel bake --recipe recipe.json crater.png -o a.texel -r 24 --no-data 1057 --threads 1 && texel check a.texel &&
  texel bake --recipe a.texel -o b.texel --threads 4 && cmp a.texel/volume.vdb b.texel/volume.vdb && cmp a.texel/preview.png b.texel/preview.png &&
  texel bake --recipe a.texel -o a.texel && texel view a.texel --truth -o truth.png --size 64x48 && rm crater_color.png &&
  texel bake --recipe a.texel -o c.texel
