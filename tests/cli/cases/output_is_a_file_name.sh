# A pack is a folder: under the name of a picture or a mesh it is refused before anything is read.
for name in x.png shots/X.EXR tree.obj/ volume.vdb; do texel bake not_there.obj -o $name; echo $?; done
ls -A
