# The folders on the way to the pack are made for the pack: no pack, no folders.
texel bake "$DATA/no_faces.obj" -o a/b/c.texel
echo $?
ls -A
