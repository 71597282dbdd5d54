"""The cases of `corpus`: files, command lines (a text between bars is one word) and scenes."""

from __future__ import annotations

WATER_XYZ = "3\nwater\nO 0 0 0.1173\nH 0 0.7572 -0.4692\nH 0 -0.7572 -0.4692\n"
LINES_CSV = (
    "j_upper,ka_upper,kc_upper,j_lower,ka_lower,kc_lower,frequency_mhz,error_mhz\n"
    "1,0,1,0,0,0,11000.004,0.01\n2,0,2,1,0,1,21970.59,0.01\n2,1,2,1,1,1,21000.01,0.01\n2,1,1,1,1,0,22999.99,0.01\n"
    "1,1,0,1,0,1,26000.003,0.01\n2,1,1,2,0,2,27029.41,0.01\n"
)
START_TOML = 'name = "start"\n[constants]\nunit = "GHz"\nsource = "guess"\nA = 31.0\nB = 6.0\nC = 5.0\n'
FAMILY_TOML = (
    'name = "OCS"\n[[isotopologue]]\nisotopes = ""\nB = 6081.492\n[[isotopologue]]\nisotopes = "S=34S"\n'
    'B = 5932.834\n[[isotopologue]]\nisotopes = "C=13C"\nB = 6061.925\n[geometry]\natoms = [["O", 0, 0, 0], ["C", 0, 0, 1.16], '
    '["S", 0, 0, 2.72]]\n'
)
FILES = {
    "water.xyz": WATER_XYZ,
    "lines.csv": LINES_CSV,
    "start.toml": START_TOML,
    "family.toml": FAMILY_TOML,
    "pulse.csv": "t_ps,intensity_w_per_cm2\n0,0\n0.5,1e12\n1,0\n",
    "a.cat": "  115271.2021  0.0000 -5.0104 2    0.0000  3      0 101 1           0           \n"
    "  230538.0000  0.0000 -4.1193 2    3.8450  5      0 101 2           1           \n"
    "  345795.9899  0.0000 -3.6111 2   11.5350  7      0 101 3           2           \n",
}

ROD = "--constants |A=9.2 B=3 C=2.5 GHz| --dipole-abc 1,0,2"

COMMANDS = [
    # spectrum
    "spectrum water --jmax 5", "spectrum water --temperature 123.4 --range 10:900.1GHz --jmax 8 --vibration 1595,3657,3756",
    "spectrum water --jmax 8 --cat a2.cat --tag 18003 --csv a.csv", "spectrum water.xyz --dipole 0,0,1.85 --isotope 2=2H --jmax 5",
    "spectrum SMILES:C=O --jmax 4 --min-lgint none --csv a.csv", "spectrum OCS --jmax 9 --pressure 2mbar --path 1m --fwhm 3MHz --profile-csv p.csv",
    f"spectrum {ROD} --spin-constants |chi_aa(14N)=-4.2 chi_bb-cc(14N)=1.1 MHz| --jmax 3 --json -",
    f"spectrum {ROD} --jmax 3 --save-scene s2.toml", "spectrum water --jmax 4 --save-scene s2.toml --csv l.csv --temperature |200 K|",
    "spectrum |--constants| |A=9.2 B=3 C=2.5 GHz| --dipole-abc 0,2,0 --spin-weights ee=1,eo=3,oe=3,oo=1 --q 99 --jmax 3",
    "spectrum HCONH2 --hyperfine --hyperfine-method auto --hyperfine-tolerance 1kHz --jmax 4", "spectrum NH3 --jmax 3",
    "spectrum CO --hitran a.hitran --hitran-id 5:1", "spectrum CO --json - --jmax 3", "spectrum CO --top 3 --sources",
    "spectrum CO --resolution 1MHz --hyperfine", "spectrum HCN --hyperfine --resolution 0.1 --jmax 4", "spectrum CO --plot a.png --jmax 5",
    "spectrum CO --plot a.svg --plot-unit cm-1 --plot-title T --plot-range 0:1THz --plot-scale log --jmax 12",
    "spectrum CO --profile voigt --fwhm 2MHz --plot a.png --jmax 6", "spectrum CO --range 2:3", "spectrum CH4",
    "spectrum water --temperature -3", "spectrum water --temperature |5 GHz|", "spectrum water --temperature 0", "spectrum water --temperature 1e9",
    "spectrum water --jmax -1", "spectrum water --jmax x", "spectrum water --min-lgint x", "spectrum water --min-lgint 1e5",
    "spectrum water --range 5", "spectrum water --range 5:4GHz", "spectrum water --range 1:2m", "spectrum water --q -1", "spectrum water --q x",
    "spectrum water --fwhm 1MHz", "spectrum water --profile gauss --plot a.png", "spectrum water --profile sticks --fwhm 1MHz --plot a.png",
    "spectrum water --pressure 1bar", "spectrum water --profile-csv a.csv", "spectrum water --top -1", "spectrum water --tag -1",
    "spectrum water --plot-title T", "spectrum water --plot a.gif", "spectrum water --csv a.txt", "spectrum water --csv no/a.csv",
    "spectrum water --hyperfine-method auto", "spectrum water --hyperfine", "spectrum water --vibration 1,2 --vibrational-states 3,4",
    "spectrum water --vibration x", "spectrum water --vibrational-factor 0", "spectrum water --vibrational-factor 2 --vibration 100",
    "spectrum nowater", "spectrum", "spectrum water --constants B=1", "spectrum --constants B=x", "spectrum --constants B=5", "spectrum CO --dipole 1",
    "spectrum CO --dipole 0,0,1 --dipole-abc 0,0,1", "spectrum CO --dipole 0,0,0.1", "spectrum --constants |B=5 GHz| --dipole 0,0,1",
    "spectrum --constants |B=5 GHz| --isotope 1=2H", "spectrum water --isotope 9=2H", "spectrum CO --spin-weights x", "spectrum CO --spins 14N",
    "spectrum CO --jmax 3 --jmax 4", "spectrum CO --nothing", "spectrum CO more", "spectrum CO --hitran a.hitran", "spectrum CO --egy a.egy",
    "spectrum CO --as-spcat", "spectrum CO --csv |", "spectrum water --resolution x", "spectrum water --json a.txt",
    # levels
    "levels water --jmax 3", "levels water --jmax 4 --unit K --csv water.csv --plot terms.png", "levels CH3CN --k 0:3 --jmax 6 --max-energy 30cm-1 --egy a.egy",
    "levels NH3 --jmax 3", "levels HCONH2 --hyperfine --jmax 3", "levels --constants |A=9.2 B=3 C=2.5 GHz| --j 2:5 --max-energy 10cm-1",
    "levels CO --json - --jmax 2", "levels CO --save-scene s2.toml --j 1:3", "levels water --j 3", "levels water --k 1 --jmax 3 --csv a.csv",
    "levels CO --k 0:1", "levels CO --j 2:1", "levels CO --j x", "levels CO --j 1 --jmax 2", "levels CO --unit eV", "levels CO --max-energy -1",
    "levels CO --max-energy 1m", "levels CO --jmax 1.5", "levels CO --top x", "levels CO --plot a.png --plot-vertical 0:10", "levels water --sources --jmax 2",
    "levels CO --plot a.png --j 3:4 --max-energy 1MHz", "levels --constants |B=10 GHz| --state-constants |E[1]=120GHz B[1]=9.9GHz| --jmax 2",
    # raman
    "raman N2", "raman CO2 --laser 488 --temperature 77.7 --min-relative 1e-3 --csv a.csv", "raman HCN --polarizability 3.9,2.0 --temperature 10 --hyperfine",
    "raman --constants |B=1.98958 cm-1| --polarizability 2.22,1.53 --spin-weights even=2,odd=1", "raman N2 --json - --jmax 4", "raman N2 --plot a.png --jmax 5",
    "raman N2 --save-scene s2.toml --laser |600 nm|", "raman N2 --laser |5 GHz|", "raman N2 --laser -1", "raman N2 --min-relative 2", "raman N2 --min-relative x",
    "raman N2 --min-relative none --jmax 3", "raman CH4", "raman HCN", "raman N2 --polarizability 1", "raman N2 --polarizability x", "raman N2 --jmax 1 --top 5",
    "raman N2 --temperature |1 THz|", "raman N2 --jmax 0 --plot a.png",
    # thermo
    "thermo water --temperature 10:300K:4", "thermo water --species ortho --temperature 100:300K:5 --gas --pressure 1atm --vibrational-states 1594.7x1,3151.6",
    "thermo H2 --species ortho --temperature 5:300K:6 --csv a.csv", "thermo HCN --hyperfine --temperature 0.001,0.01,0.1", "thermo CO --json - --temperature 10,20",
    "thermo CO --save-scene s2.toml --temperature 10,20 --gas", "thermo CO --pressure 1bar", "thermo CO --gas --pressure -1bar", "thermo CO --species x", "thermo CO --temperature 0",
    "thermo CO --temperature x", "thermo CO --temperature 10:20", "thermo CO --plot a.png --temperature 10:100:5", "thermo CO --temperature |1e7 K|", "thermo water",
    # tumble
    "tumble water --temperature 100 --times 0:2ps:21 --csv a.csv", "tumble OCS --angular-momentum 0,10.1,0.3", "tumble --moments 0.6,0.8,1.0 --angular-momentum 1.8,0.4,-0.9 --times 0,1,2.7",
    "tumble book --times 0:2:21", "tumble --moments |1,2,3 kg m2| --omega 0.1,5,0 --times 0:2:21 --json -",
    "tumble book --times 0:2:21 --effect |linear drag coefficients=1e-4,1e-4,2e-4| --csv a.csv",
    "tumble --moments 1,2,3 --omega 0.1,1,0 --times 0,1,2.7 --step 0.1 --order 2 --attitude 0.6,0,0.8,0 --effect |periodic drive amplitude=0.1,0,0 angular_frequency=1.2 frame=space| --save-scene s2.toml",
    "tumble water --save-scene s2.toml", "tumble --moments 1,2,3", "tumble --moments 1,2", "tumble --moments 1,2,9 --omega 1,1,1", "tumble water --omega 0,0,0",
    "tumble water --temperature -1", "tumble", "tumble water --times 0:1", "tumble --moments 1,2,3 --omega 1,0,0 --effect nothing", "tumble water --effect |linear drag coefficients=1,1,1|",
    "tumble water --plot a.png", "tumble water --moments 1,2,3", "tumble --body spoon", "tumble --moments 1,2,3 --omega 1,0,0 --temperature 3",
    # stark
    "stark OCS --field 10,20 --states J<=1 --intensity |1e9 W/cm2| --tilt 45", "stark OCS --field 0:77.7kV/cm:5 --states J<=1 --intensity |1e10 W/cm2| --diabatic-gap 5 --csv a.csv",
    "stark HC3N --field 0,0.3 --states J<=1 --m 1 --spin-constants |chi_aa(14N)=-4.3 MHz|", "stark OCS --field 0:5kV/cm:7 --states J<=2 --line |2 - 1| --light perpendicular --lines lobes.csv --coefficients c.csv",
    "stark OCS --field 20kV/cm --states J<=1 --spread 0.005 --linewidth 50MHz --range 0:30GHz --spectrum ocs.csv", "stark OCS --field 0:50kV/cm:3 --temperature 1 --mixture m.csv --deflection d.csv --states J<=1",
    "stark OCS --field 0:10:3 --states J<=1 --json -", "stark OCS --field 0:10:3 --states J<=1 --save-scene s2.toml", "stark OCS --field 0:10:3 --states J<=1 --plot a.png",
    "stark OCS --field 0:100V", "stark OCS --field 5:1", "stark OCS --field x", "stark OCS --states x --field 0,1", "stark OCS --m -1 --field 0,1", "stark OCS --tilt x --field 0,1",
    "stark OCS --tolerance 0 --field 0,1", "stark OCS --jmax 900 --field 0,1", "stark OCS --intensity -1 --field 0,1", "stark OCS --light x --field 0,1", "stark OCS --line x --field 0,1",
    "stark N2 --field 0,1", "stark OCS --field 1 --plot a.png", "stark OCS --workers 0 --field 0,1", "stark OCS --diabatic-gap 0 --field 0,1", "stark OCS --linewidth x --field 0,1",
    # zeeman
    "zeeman OCS --g -0.02 --magnetisability 1.5,-2.5 --field 0:2T:3 --states J<=1 --csv a.csv", "zeeman --constants |A=10 B=6 C=4 GHz| --g 0.6,-0.2,0.3,0.05,0,0 --field 0,33.3 --states J<=1 --tolerance 1e-5",
    "zeeman HC3N --g -0.01 --field 0:200G:3 --states J<=1 --spin-constants |chi_aa(14N)=-4.3 MHz| --nuclear-g 14N=0.4", "zeeman OCS --g -0.03 --field 1T --json -", "zeeman OCS --g -0.03 --field 0:1T:3 --save-scene s2.toml --states J<=1",
    "zeeman OCS", "zeeman OCS --g x", "zeeman OCS --g -0.03 --field 0:5V", "zeeman OCS --g -0.03 --nuclear-g x", "zeeman OCS --g -0.03 --tolerance -1", "zeeman OCS --g -0.03 --field 0:1T:3 --plot a.png --states J<=1",
    # align
    "align OCS --pulse |1e12 W/cm2, 0.3 ps| --kick |1e-2 J/cm2, 5 ps| --polarization elliptical:0.3 --temperature 0 --points 51 --csv a.csv",
    "align --constants |B=6081.492 MHz| --anisotropy 4.04 --switched |1e11 W/cm2, 1, 2, 0.5| --temperature 0 --until 20ps --points 31",
    "align OCS --thz |100 kV/cm, 1 ps, 0.3 THz| --observable costheta --observable cos2theta --state j=1 --m 0 --until 20 --points 31",
    "align OCS --pulse-table pulse.csv --temperature 0 --points 11 --json -", "align OCS --kick |1e-2 J/cm2| --temperature 0 --points 11 --save-scene s2.toml --until 5ps", "align OCS",
    "align OCS --pulse x", "align OCS --pulse |1e12, 1, 2, 3, 4|", "align OCS --kick 1 --polarization q", "align OCS --kick |1e-2 J/cm2| --state x", "align OCS --kick |1e-2 J/cm2| --points 0",
    "align OCS --kick |1e-2 J/cm2| --temperature -1", "align OCS --kick |1e-2 J/cm2| --observable x", "align OCS --kick |1e-2 J/cm2| --polarizability 1,2 --anisotropy 3", "align OCS --kick |1e-2 J/cm2| --tolerance 0",
    "align OCS --kick |1e-2 J/cm2| --temperature 0 --points 11 --plot a.png --classical 100",
    # gas
    "gas OCS --molecules 500 --temperature 200 --seed 5", "gas water --molecules 300 --times 0:2:11 --csv a.csv", "gas CO --molecules 100 --json -", "gas CO --molecules 100 --save-scene s2.toml --times 0,1", "gas CO --molecules 1",
    "gas CO --molecules x", "gas CO --temperature -1", "gas CO --seed -1", "gas CO --confidence 2", "gas CO --times x", "gas CO --molecules 50 --plot a.png", "gas CO --confidence |99 %| --molecules 50",
    # fluid
    "fluid water --molecules 8 --density 0.1 --ensemble langevin --steps 10 --cutoff 5 --seed 3 --temperature 320 --csv a.csv", "fluid argon --molecules 27 --model argon --density 1.0 --temperature 90 --step 5fs --steps 10 --cutoff 5 --json -",
    "fluid water --molecules 8 --density 0.1 --steps 10 --cutoff 5 --save-scene s2.toml", "fluid water", "fluid water --molecules 0", "fluid water --molecules 8 --density x", "fluid water --density 1", "fluid water --molecules 8 --model x",
    "fluid water --molecules 8 --ensemble x", "fluid water --molecules 8 --step 0", "fluid water --molecules 8 --cutoff 50", "fluid water --molecules 8 --steps -1", "fluid water --molecules 8 --engine x", "fluid argon --molecules 8",
    "fluid water --molecules 8 --friction x", "fluid nofile.traj --steps 1",
    # emission
    "emission CO --range 115.1:115.4GHz --column 1e17 --excitation 20 --width 2", "emission CH3CN HC3N --band ALMA3 --column 1e15,3e14 --excitation 50 --width 5 --csv a.csv --top 5", "emission CO --band ALMA3 --json -",
    "emission CO --band ALMA3 --save-scene s2.toml --profile-csv p.csv", "emission CO --isotope C=13C --band ALMA3 --column 1e16 --excitation 10 --velocity 5.6", "emission HCN --range 88.62:88.64GHz --hyperfine --width 0.3 --excitation 10",
    "emission CO", "emission", "emission CO --band X", "emission CO --band ALMA3 --range 1:2GHz", "emission CO HCN --isotope C=13C --band ALMA3", "emission CO --band ALMA3 --column x", "emission CO --band ALMA3 --excitation -1",
    "emission CO --excitation 20,50 --band ALMA3", "emission CO --band ALMA3 --filling 2", "emission CO --band ALMA3 --width 0", "emission CO --band ALMA3 --plot a.png --plot-unit GHz", "emission CO --band ALMA3 --velocity x",
    # fit
    "fit lines.csv --start start.toml --free A,B,C", "fit lines.csv --start start.toml --free A,B,C --json -", "fit lines.csv --start start.toml --free A,B,C --save-scene s2.toml --out o", "fit lines.csv", "fit nofile.csv --start start.toml",
    "fit lines.csv --start start.toml --free Q",
    # others
    "info water", "info water.xyz", "info |SMILES:CO| --json -", "info --constants |B=5 GHz|", "info water --temperature 10,100", "info nothing", "info CO --hessian x", "info water --isotope 1=18O",
    "molecules", "molecules water", "molecules --json -", "isotopologues water", "isotopologues CO --json -", "isotopologues nothing", "structure family.toml", "structure nothing.toml", "convert start.toml b.par", "convert start.toml b.xyz",
    "convert nothing.toml b.par", "cat a.cat", "cat a.cat --range 100:200GHz", "cat a.cat --json -", "cat nothing.cat", "new spectrum", "new levels", "new raman", "new thermo", "new tumble", "new gas", "new fluid", "new stark", "new zeeman",
    "new align", "new fit", "new emission", "new nothing", "run nothing.toml", "plan nothing.toml", "nothing", "--version", "--nothing",
]  # fmt: skip

_BAD = [
    'schema = 1\nkind = "levels"\nmolecule = "CO"\n[observables]\nj_max = 3\n', 'schema = 2\nkind = "levels"\n', 'kind = "levels"\n', "schema = 1\n", "x = [", 'schema = 1\nkind = "level"\n',
    'schema = 1\nkind = "levels"\nmolecule = "CO"\n[observables]\njmax = "x"\n', 'schema = 1\nkind = "levels"\nmolecule = "CO"\n[observables]\njmax = -1\n', 'schema = 1\nkind = "levels"\nmolecule = "CO"\n[observables]\njmax = 1.5\n',
    'schema = 1\nkind = "levels"\nmolecule = "CO"\n[observables]\nmax_energy = "1 m"\n', 'schema = 1\nkind = "levels"\n', 'schema = 1\nkind = "levels"\nmolecule = { source = "CO", constants = "B=1" }\n',
    'schema = 1\nkind = "spectrum"\nmolecule = "CO"\n[conditions]\ntemperature = "-3 K"\n', 'schema = 1\nkind = "spectrum"\nmolecule = "CO"\n[conditions]\nrange = "3:2GHz"\n',
    'schema = 1\nkind = "spectrum"\nmolecule = "CO"\n[observables]\nmin_lgint = "x"\n', 'schema = 1\nkind = "spectrum"\nmolecule = "CO"\n[conditions]\npressure = "1 bar"\n',
    'schema = 1\nkind = "spectrum"\nmolecule = "CO"\n[observables]\nprofile = "gauss"\n', 'schema = 1\nkind = "spectrum"\nmolecule = "CO"\n[outputs]\ncsv = "a.txt"\n',
    'schema = 1\nkind = "spectrum"\nmolecule = "CO"\n[effects]\nhyperfine_method = "auto"\n', 'schema = 1\nkind = "raman"\nmolecule = "HCN"\n', 'schema = 1\nkind = "raman"\nmolecule = "N2"\n[conditions]\nlaser = "5 GHz"\n',
    'schema = 1\nkind = "align"\nmolecule = "OCS"\n[[pulses]]\nshape = "gauss"\npeak = 1\nfwhm = 1\n', 'schema = 1\nkind = "align"\nmolecule = "OCS"\n[[pulses]]\nshape = "gaussian"\npeak = 1e12\nfwhm = -1\n',
    'schema = 1\nkind = "align"\nmolecule = "OCS"\n', 'schema = 1\nkind = "tumble"\n', 'schema = 1\nkind = "tumble"\nmolecule = "OCS"\n[body]\nmoments = [1.0, 2.0, 3.0]\n', 'schema = 1\nkind = "stark"\nmolecule = "OCS"\n[conditions]\nfield = "0:5V"\n',
    'schema = 1\nkind = "zeeman"\nmolecule = "OCS"\n', 'schema = 1\nkind = "fluid"\n[conditions]\nmolecules = 0\n', 'schema = 1\nkind = "emission"\nmolecules = []\n', 'schema = 1\nkind = "gas"\nmolecule = "CO"\n[numerics]\nmolecules = 1\n',
]  # fmt: skip
_GOOD = [
    'kind = "levels"\nmolecule = "CO"\n[outputs]\ncsv = "a.csv"\n', 'kind = "levels"\nmolecule = "CO"\naccuracy = "1 kHz"\n', 'kind = "levels"\ntitle = "t"\nmolecule = { constants = "A=9.2 B=3 C=2.5 GHz" }\n[observables]\njmax = 3\n',
    'kind = "levels"\nmolecule = "CO"\n[effects]\ndistortion = false\n[outputs]\ncsv = "a.csv"\negy = "a.egy"\nplot = "a.png"\n',
    'kind = "spectrum"\nmolecule = "CO"\n[conditions]\ntemperature = 100\nrange = "0:1THz"\n[outputs]\ncsv = "a.csv"\ncat = "b.cat"\ntag = 28001\n',
    'kind = "spectrum"\nmolecule = "CO"\naccuracy = "1 kHz"\n[conditions]\npressure = "1 mbar"\npath = "1 m"\n[outputs]\nprofile_csv = "p.csv"\nplot = "a.png"\n',
    'kind = "spectrum"\nmolecule = "HCONH2"\n[effects]\nhyperfine = true\n[numerics]\njmax = 3\n[outputs]\ncsv = "a.csv"\njson = "a.json"\n',
    'kind = "spectrum"\nmolecule = "CO"\n[vibration]\nfundamentals = "2143"\n[observables]\nmin_lgint = "none"\n[numerics]\njmax = 4\n', 'kind = "spectrum"\nmolecule = "CO"\n[sweep]\n"conditions.temperature" = ["10 K", "20 K"]\n[outputs]\ncsv = "{temperature}.csv"\n',
    'kind = "raman"\nmolecule = "N2"\n[conditions]\nlaser = "488 nm"\n[outputs]\ncsv = "a.csv"\n', 'kind = "raman"\nmolecule = { source = "HCN", polarizability = [3.9, 2.0] }\n[numerics]\njmax = 4\n[observables]\nmin_relative = "none"\n[outputs]\ncsv = "a.csv"\n',
    'kind = "raman"\nmolecule = "N2"\naccuracy = "1 kHz"\n[outputs]\nplot = "a.png"\n', 'kind = "thermo"\nmolecule = "water"\n[conditions]\ntemperature = "10:300K:4"\npressure = "1 bar"\n[outputs]\ncsv = "a.csv"\n',
    'kind = "thermo"\nmolecule = "CO"\naccuracy = "0.1 %"\n[conditions]\ntemperature = [10.0, 20.0]\n[outputs]\ncsv = "a.csv"\n', 'kind = "tumble"\nmolecule = "water"\n[conditions]\ntimes = "0:1:5"\n[outputs]\ncsv = "a.csv"\n',
    'kind = "tumble"\n[body]\nmoments = [1.0, 2.0, 3.0]\nangular_velocity = [0.1, 1.0, 0.0]\n[conditions]\ntimes = "0:1:5"\n[outputs]\ncsv = "a.csv"\n',
    'kind = "tumble"\naccuracy = "1e-6 rad"\n[body]\nmoments = [1.0, 2.0, 3.0]\nangular_velocity = [0.1, 1.0, 0.0]\n[[effects]]\neffect = "linear drag"\ncoefficients = [0.1, 0.1, 0.1]\n[conditions]\ntimes = "0:1:5"\n[outputs]\ncsv = "a.csv"\n',
    'kind = "gas"\nmolecule = "CO"\n[numerics]\nmolecules = 100\n[observables]\ntimes = "0:1:5"\n[outputs]\ncsv = "a.csv"\n', 'kind = "stark"\nmolecule = "OCS"\n[conditions]\nfield = "0:10:3"\n[observables]\njmax = 1\nm = [0, 1]\n[outputs]\ncsv = "a.csv"\nplot = "a.png"\n',
    'kind = "stark"\nmolecule = "OCS"\naccuracy = "1 kHz"\n[conditions]\nfield = [0.0, 10.0]\ndirection = [0.6, 0.0, 0.8]\nintensity = "1e9 W/cm2"\n[observables]\njmax = 1\ndiabatic_gap = "1 MHz"\n[outputs]\ncsv = "a.csv"\n',
    'kind = "zeeman"\nmolecule = "OCS"\n[magnetic]\ng = [-0.03]\nmagnetisability = [1.5, -2.5]\n[conditions]\nfield = "0:1T:3"\n[observables]\njmax = 1\n[outputs]\ncsv = "a.csv"\n',
    'kind = "align"\nmolecule = "OCS"\n[[pulses]]\nshape = "gaussian"\npeak = "1e12 W/cm2"\nfwhm = "0.2 ps"\n[conditions]\ntemperature = 0\npoints = 11\n[outputs]\ncsv = "a.csv"\n',
    'kind = "align"\nmolecule = "OCS"\n[[pulses]]\nshape = "kick"\nfluence = 0.01\naxis = "circular"\n[[pulses]]\nshape = "thz"\npeak = 10\nfwhm = 1\n[conditions]\nstate = { j = 1 }\nm = 0\nlast_time = "10 ps"\npoints = 11\n[observables]\ncosines = ["costheta"]\n',
    'kind = "fluid"\n[conditions]\nmodel = "argon"\nmolecules = 27\ndensity = 0.5\nsteps = 5\nevery = 1\n[numerics]\ncutoff = "5 Å"\n[outputs]\ncsv = "a.csv"\n',
    'kind = "fit"\nmolecule = "start.toml"\n[lines]\nsource = "lines.csv"\n[parameters]\nfree = ["A", "B", "C"]\n[outputs]\ncsv = "a.csv"\nreport = "a.fit"\n',
    'kind = "emission"\n[[molecules]]\nsource = "CO"\ncolumn = 1e16\n[[molecules]]\nsource = "HCN"\n[conditions]\nexcitation = "20 K"\nband = "ALMA3"\n[outputs]\ncsv = "a.csv"\nplot = "a.png"\n',
    'kind = "levels"\nmolecule = { source = "water.xyz", isotopes = ["2=2H"], dipole = [0, 0, 1.85] }\n[observables]\njmax = 2\nkmax = 1\nmax_energy = "100 cm-1"\n[outputs]\ncsv = "a.csv"\n',
    'kind = "spectrum"\nmolecule = { constants = "B=10 GHz", dipole_abc = [1, 0, 0], spin_constants = "chi_aa(14N)=-4 MHz", spins = "14N=1" }\n[numerics]\njmax = 2\n[outputs]\ncsv = "a.csv"\n',
]  # fmt: skip
SCENES = [*_BAD, *("schema = 1\n" + text for text in _GOOD)]
