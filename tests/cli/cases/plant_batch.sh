# Plants of a folder are taken; symbols and tables are parts of others.
mkdir -p in; cp "$ROOT/samples/plant/plant.opf" in/; printf '<gwa><mesh><points>0 0 0 1 0 0 0 1 0</points><faces>0 1 2</faces></mesh></gwa>' > in/soil.gwa
printf '1\t1\tplant.opf\t0\t0\t0\t1\t0\t0\t0\n1\t2\tplant.opf\t1\t0\t0\t2\t0\t0\t90\n1\t3\tsoil.gwa\t0\t0\t0\t0\t0\t0\t0\n' > in/stand.ops
printf x > in/leaf.smb; printf x > in/old.dta
texel batch in -o out -r 16 --want density,color > /dev/null 2>&1; echo $?; ls out
