cp "$ROOT/samples/terrain/crater.png" .
f=crater.png
printf 'no picture' > text.png
printf 'P5 3 1 255 abc' > row.pgm
printf 'P5 2 2 255 abcd' > flat.pgm
for arguments in "--base 1" "--extent 1" "--extent 0,1" "--height 0" "--height-color gone.png" "--no-data x" "--perlin-field 0,1,1" "--perlin-field 4"; do
  texel bake "$f" -o x.texel $arguments
  echo "$arguments: $?"
done
for input in text.png row.pgm gone.tif; do
  texel bake $input -o x.texel
  echo "$input: $?"
done
texel bake flat.pgm --no-data 97 -o x.texel
echo "no data: $?"
ls
