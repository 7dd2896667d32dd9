cp $DATA/cube.obj $DATA/cube.mtl .
texel bake cube.obj -o a.texel -r 8 2>/dev/null
texel compare a.texel --level 0 --allow alpha_rms=0.01 --allow area_relative=0.001 | tail -2
texel compare a.texel cube.obj --level 0 -v --voxels 20 --columns 20 | grep -E '^(measure|alpha_rms|solid_rms)'
texel compare a.texel $DATA/cube.obj --truth --views 2 --recede 1 --size 32x32 --level 0 | grep -E '^(image|silhouette|recede)' | sed 's/ .*//'
texel compare a.texel --level 0 --allow sigma_max=0.1 > figures
echo $?
tail -1 figures
# Another geometry than the pack's.
sed '/^v /s/ 1/ 0.9/g' cube.obj > other.obj
texel compare a.texel other.obj --level 0 --allow area_relative=0.01 > figures
