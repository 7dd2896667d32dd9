# Fog of one density lets through columns, beams and the whole what its voxels say; another density does not.
texel bake --hypertexture fog --implicit '0.3' --box 0,0,0,1,1,1 -r 8 --density-scale 4 --want density,visibility -o fog.texel 2>/dev/null
texel compare fog.texel --voxels 20 --columns 20 --allow column_rms=0.001 --allow direction_rms=0.001 > figures
echo $?
tail -2 figures
texel bake --hypertexture fog --implicit 'step(x, 0.5)' --box 0,0,0,1,1,1 -r 8 --want density,visibility -o slab.texel 2>/dev/null
texel compare slab.texel --voxels 20 --columns 20 --allow volume_relative=0.01 | tail -1
# Light from extinction alone, where there are no opacities.
texel bake --hypertexture fog --implicit '0.3' --box 0,0,0,1,1,1 -r 8 --density-scale 4 --want density -o thin.texel 2>/dev/null
texel compare thin.texel --columns 20 --level 0 | grep -E '^(column_rms|skipped)' | sed 's/  .*//'
