# Both kinds are taken from folders; .bin files are parts of others. A file may have the other kind's name.
mkdir in; cp "$ROOT"/tests/data/gltf/*.glb "$ROOT"/tests/data/gltf/*.gltf "$ROOT"/tests/data/gltf/*.bin in/
texel batch in -o out -r 16 --want density,color > /dev/null 2>&1; echo $?; ls out
cp in/cards.glb wrong.gltf; texel bake wrong.gltf --plan -r 16 2>&1 | grep warning
cp in/nested.gltf wrong.glb; texel bake wrong.glb --plan -r 16 2>&1 | grep warning
