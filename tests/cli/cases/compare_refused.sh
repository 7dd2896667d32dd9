texel bake $DATA/cube.obj -o a.texel -r 8 --want density 2>/dev/null
texel bake $DATA/cube.obj -o b.texel -r 9 --want density 2>/dev/null
for arguments in "" "nothing.texel" "$DATA/cube.obj a.texel" "a.texel b.texel" "a.texel a.texel --truth" "a.texel a.texel b.texel" "a.texel nothing.obj" \
    "a.texel a.texel --allow alpha=1" "a.texel a.texel --allow alpha_rms=-1" "a.texel a.texel --allow color_rms=1" "a.texel --level 9" "a.texel --voxels 0"; do
  texel compare $arguments
  echo "$arguments: $?"
done
